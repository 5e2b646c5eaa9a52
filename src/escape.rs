//! Text that a terminal may show, and that a shell may read.

use std::borrow::Cow;

/// A text as it may be shown on a terminal: control characters, which could command it, become escapes;
/// line ends and tabs stay.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let commands = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if !text.contains(commands) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::new();
    for c in text.chars() {
        match commands(c) {
            true => shown.extend(c.escape_default()),
            false => shown.push(c),
        }
    }
    Cow::Owned(shown)
}

/// A path or an argument quoted for a shell.
pub fn shell_quoted(path: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+,:@=".contains(c) || !c.is_ascii();
    match !path.is_empty() && path.chars().all(plain) && !path.starts_with('-') {
        true => path.to_owned(),
        false => format!("'{}'", path.replace('\'', "'\\''")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_quoted_where_a_shell_would_take_them_apart() {
        let paths = ["models/a.yaml", "my model.yaml", "it's.yaml", "$(x)"];
        let expected = [
            "models/a.yaml",
            "'my model.yaml'",
            "'it'\\''s.yaml'",
            "'$(x)'",
        ];
        assert_eq!(paths.map(shell_quoted), expected);
    }
}
