//! A comparison as text for the terminal.

use super::Comparison;
use super::selection;
use super::table::{QuantityRow, known_rows};
use crate::report::text::clean;
use std::fmt::Write;

/// Widest line in characters; further runs form another table below.
const WIDEST: usize = 100;
const GAP: usize = 2;

/// A line for each run, then the table.
pub(super) fn text(comparison: &Comparison) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_runs(&mut text, comparison);
    let selection = selection::table(&comparison.measures);
    if !selection.is_empty() {
        let _ = write!(text, "\n{}\n", plain_lines(&selection));
        for sentence in selection::sentences(comparison) {
            let _ = writeln!(text, "{}", plain(&sentence));
        }
    }
    let names: Vec<String> = (comparison.measures.iter())
        .map(|m| plain(&m.name))
        .collect();
    let _ = write_table(&mut text, &names, &known_rows(&comparison.measures));
    text
}

fn write_runs(text: &mut String, comparison: &Comparison) -> std::fmt::Result {
    for run in &comparison.measures {
        writeln!(text, "{}: {}", plain(&run.name), plain(&run.title))?;
        writeln!(text, "  {}", run.verdict)?;
    }
    if let Some(warning) = comparison.warning() {
        writeln!(text, "warning: {}", plain(&warning))?;
    }
    for left_out in &comparison.left_out {
        let (name, reason) = (plain(&left_out.name), plain(&left_out.reason));
        writeln!(text, "{name}: no result\n  {reason}")?;
    }
    Ok(())
}

/// One line without control characters.
fn plain(text: &str) -> String {
    clean(text).replace(['\n', '\t'], " ")
}

/// Lines without control characters.
fn plain_lines(text: &str) -> String {
    text.lines().map(|line| plain(line) + "\n").collect()
}

fn write_table(text: &mut String, names: &[String], rows: &[QuantityRow]) -> std::fmt::Result {
    let labels = rows.iter().map(|row| width(&row.label)).max().unwrap_or(0);
    let widths: Vec<usize> = (0..names.len())
        .map(|j| {
            let cells = rows.iter().map(|row| width(&row.cells[j].short()));
            GAP + cells.fold(width(&names[j]), usize::max)
        })
        .collect();
    for block in blocks(&widths, WIDEST.saturating_sub(labels)) {
        write!(text, "\n{:labels$}", "")?;
        for j in block.clone() {
            write!(text, "{:>1$}", names[j], widths[j])?;
        }
        writeln!(text)?;
        for row in rows {
            write!(text, "{:<labels$}", row.label)?;
            for j in block.clone() {
                write!(text, "{:>1$}", row.cells[j].short(), widths[j])?;
            }
            writeln!(text)?;
        }
    }
    Ok(())
}

fn width(text: &str) -> usize {
    text.chars().count()
}

/// Ranges of columns that fit into the width, at least one column each.
fn blocks(widths: &[usize], available: usize) -> Vec<std::ops::Range<usize>> {
    let mut blocks: Vec<std::ops::Range<usize>> = Vec::new();
    let mut used = 0;
    for (j, width) in widths.iter().enumerate() {
        match blocks.last_mut() {
            Some(block) if used + width <= available => block.end = j + 1,
            _ => {
                blocks.push(j..j + 1);
                used = 0;
            }
        }
        used += width;
    }
    blocks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_tables_are_split_between_runs() {
        assert_eq!(blocks(&[10, 10, 10, 40], 25), [0..2, 2..3, 3..4]);
        assert!(blocks(&[], 25).is_empty());
    }

    #[test]
    fn control_characters_are_removed() {
        assert_eq!(plain("a\u{1b}[31m\nb"), "a[31m b");
    }
}
