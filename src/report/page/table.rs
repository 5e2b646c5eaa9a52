//! Tables, lists and facts as HTML; every text is escaped here.

use crate::report::text::{decade, escape, prose};

/// A table named `name` with a heading for each column; the first cell of a row is its heading. On narrow screens each row is a list of
/// its values with their headings, so that no column is hidden; the roles keep it a table for screen readers.
pub(crate) fn table(name: &str, headings: &[&str], rows: &[Vec<String>]) -> String {
    if rows.is_empty() {
        return String::new();
    }
    let heading = |h: &&str| format!("<th scope=\"col\" role=\"columnheader\">{}</th>", escape(h));
    let head: String = headings.iter().map(heading).collect();
    let body: String = rows.iter().map(|cells| row(headings, cells)).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{}\">\n<table class=\"stack\" role=\"table\">\n\
         <thead role=\"rowgroup\">\n<tr role=\"row\">{head}</tr>\n</thead>\n<tbody role=\"rowgroup\">\n{body}</tbody>\n</table>\n</div>\n",
        escape(name)
    )
}

fn row(headings: &[&str], cells: &[String]) -> String {
    let mut text = String::from("<tr role=\"row\">");
    for (i, cell) in cells.iter().enumerate() {
        let heading = escape(headings.get(i).copied().unwrap_or_default());
        text += &match i {
            0 => format!("<th scope=\"row\" role=\"rowheader\">{}</th>", escape(cell)),
            _ => format!(
                "<td role=\"cell\" data-heading=\"{heading}\">{}</td>",
                escape(cell)
            ),
        };
    }
    text + "</tr>\n"
}

/// Names and their descriptions as a list.
pub(super) fn pairs(rows: &[(&str, String)]) -> String {
    let row = |(name, value): &(&str, String)| {
        format!("<dt>{}</dt><dd>{}</dd>\n", escape(name), escape(value))
    };
    let rows: String = rows.iter().map(row).collect();
    format!("<dl class=\"pairs\">\n{rows}</dl>\n")
}

/// Sentences as a list; empty without sentences.
pub(in crate::report) fn list(sentences: &[String]) -> String {
    if sentences.is_empty() {
        return String::new();
    }
    let item = |s: &String| format!("<li>{}</li>\n", prose(s.trim()));
    let items: String = sentences.iter().map(item).collect();
    format!("<ul>\n{items}</ul>\n")
}

pub(crate) fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", prose(text))
}

/// A number with five significant digits and a true minus sign.
pub(super) fn number(x: f64) -> String {
    // Rounded first: 0.999999 has the decimals of 1.
    let size: f64 = format!("{:.4e}", x.abs()).parse().unwrap_or(x.abs());
    let text = match size {
        _ if !x.is_finite() => "unknown".into(),
        0.0 => "0".into(),
        _ if (1e-3..1e5).contains(&size) => {
            let positions = (4 - size.log10().floor() as i32).clamp(0, 8) as usize;
            format!("{x:.positions$}")
        }
        _ => {
            let text = format!("{x:.4e}");
            let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
            format!("{mantissa}×{}", decade(exponent.parse().unwrap_or(0)))
        }
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_five_digits() {
        let said = [0.0, -1.0 / 3.0, 12345.6, 1e-7, 2.5e9, f64::NAN].map(number);
        let expected = [
            "0",
            "−0.33333",
            "12346",
            "1.0000×10⁻⁷",
            "2.5000×10⁹",
            "unknown",
        ];
        assert_eq!(said, expected);
    }

    #[test]
    fn texts_are_escaped() {
        let bad = "<b>&";
        let all = table(bad, &[bad], &[vec![bad.into(), bad.into()]])
            + &pairs(&[(bad, bad.into())])
            + &list(&[bad.into()])
            + &paragraph(bad);
        assert_eq!(all.matches("&lt;b&gt;&amp;").count(), 8);
        assert!(!all.contains("<b>"));
    }
}
