//! Units stated by a table: in its row of units, in brackets after a column's name, and at the end of the name.

use super::Table;
use crate::error::InputError;
use crate::headings::{REMARKS, range_of, split_unit};
use crate::text_io::quote;
use crate::units::{Measurand, Unit, unbracketed};

/// Part of a range above which samples are outside it.
const EXCESS: f64 = 1.5;

/// Unit of one column as stated by a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StatedUnit<'a> {
    /// The field in the row of units, without brackets.
    row: Option<&'a str>,
    /// The text in brackets or after a slash that follows the name.
    header: Option<&'a str>,
    /// The name without this text.
    name: &'a str,
}

impl<'a> StatedUnit<'a> {
    /// The text that states the unit: the field in the row of units, else the text after the name.
    pub fn text(&self) -> Option<&'a str> {
        self.row.or(self.header)
    }

    /// The unit of this quantity in the row of units or after the name.
    pub fn explicit(&self, kind: Measurand) -> Option<Unit> {
        let unit = |text: Option<&str>| Unit::recognise(kind, text?);
        unit(self.row).or_else(|| unit(self.header))
    }

    /// The unit of this quantity at the end of the name, as in `y_mm` and `a_m_per_s2`, or before remarks and numbers, as in `acc_g_filtered`.
    pub fn suffix(&self, kind: Measurand) -> Option<Unit> {
        let mut name = self.name;
        while let Some((before, word)) = name.rsplit_once('_')
            && is_remark(word)
        {
            name = before;
        }
        name.match_indices('_').find_map(|(at, _)| {
            let end = name[at + 1..].replace("_per_", "/");
            let unit = |between: &str| Unit::recognise(kind, &end.replace('_', between));
            unit(" ").or_else(|| unit("/")).or_else(|| unit(""))
        })
    }

    /// The unit of this quantity as the last word of the name but for remarks, as in `Force N`, `acc.g`, `accelerationInG`, `acc, g, ch 3`.
    pub fn last_word(&self, kind: Measurand) -> Option<Unit> {
        let unit = |word: &str| Unit::recognise(kind, word);
        let (_, last) = self.name.rsplit_once(' ').unwrap_or_default();
        let words = self.name.split([' ', '_', '.', '-', ',', '*']);
        let mut words = words.filter(|word| !word.is_empty());
        let first = words.next().unwrap_or(self.name);
        let word = words.rfind(|word| !is_remark(word));
        unit(last).or_else(|| unit(word?)).or_else(|| {
            // `accG`, `forcekN`.
            let name = word.unwrap_or(first);
            let (at, _) = name.char_indices().rfind(|(_, c)| c.is_uppercase())?;
            let before = name[..at]
                .chars()
                .next_back()
                .filter(|c| c.is_lowercase())?;
            let prefixed = at - before.len_utf8();
            let with_prefix = || unit(&name[prefixed..]).filter(|_| "kmuµ".contains(before));
            with_prefix().or_else(|| unit(&name[at..]))
        })
    }

    /// True if the row of units and the name state different units for every quantity.
    fn is_contradiction(&self) -> bool {
        let (Some(row), Some(header)) = (self.row, self.header) else {
            return false;
        };
        let units = |text| Measurand::ALL.map(|kind| Unit::recognise(kind, text));
        let (row, header) = (units(row), units(header));
        let is_unit = |units: &[Option<Unit>]| units.iter().any(Option::is_some);
        let agree = row.iter().zip(&header).any(|(a, b)| a.is_some() && a == b);
        is_unit(&row) && is_unit(&header) && !agree
    }
}

/// True for a number, or a word that is no unit.
fn is_remark(word: &str) -> bool {
    let small = word.to_lowercase();
    word.chars().all(|c| c.is_ascii_digit())
        || REMARKS
            .split(' ')
            .chain(["raw", "filt"])
            .any(|remark| remark == small)
}

impl Table {
    /// States the range of a heading that the samples exceed: they are counts of a converter.
    pub(super) fn check_ranges(&mut self) {
        for (header, column) in self.headers.iter().zip(&mut self.columns) {
            let largest = column
                .samples
                .iter()
                .fold(0.0f64, |most, x| most.max(x.abs()));
            if let Some(range) = range_of(header).filter(|range| largest > EXCESS * range) {
                let statement = format!("a range of {range}, which the samples exceed");
                column.unapplied.push(statement);
            }
        }
    }

    /// The stated unit of a column.
    pub fn stated_unit(&self, index: usize) -> StatedUnit<'_> {
        let (name, header) = split_unit(self.headers().get(index).map_or("", String::as_str));
        let row = self.units_row().get(index).map(|text| unbracketed(text));
        StatedUnit {
            // A dash denotes no unit.
            row: row.filter(|text| !matches!(*text, "" | "-")),
            header,
            name,
        }
    }

    /// Refuses a column whose name states one unit and whose field in the row of units another.
    ///
    /// # Errors
    /// At the row of units, with both.
    pub fn check_stated_unit(&self, index: usize) -> Result<(), InputError> {
        let stated = self.stated_unit(index);
        if !stated.is_contradiction() {
            return Ok(());
        }
        let problem = format!("two units for the column {}", quote(&self.label(index)));
        let [row, header] = [stated.row, stated.header].map(|unit| quote(unit.unwrap_or_default()));
        let Some(format) = self.text_format() else {
            return Err(InputError::file(self.path(), problem)
                .found(format!("{row} as its unit, {header} in its name"))
                .expected("the same unit in both, or in one of them"));
        };
        let line = |line: Option<usize>| line.unwrap_or(1);
        let units_row = line(format.units_row);
        Err(InputError::line(self.path(), units_row, 1, problem)
            .found(format!(
                "{row} in the row of units (line {units_row}), {header} in the column name (line {})",
                line(format.header)
            ))
            .expected("the same unit in both, or in one of them"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(text: &str) -> Table {
        Table::parse("t.csv", text.as_bytes()).expect("a table")
    }

    #[test]
    fn units_are_read_at_the_ends_of_names() {
        for (name, kind, symbol) in [
            ("y_mm", Measurand::Displacement, Some("mm")),
            ("left_y_mm", Measurand::Displacement, Some("mm")),
            ("t_ms", Measurand::Time, Some("ms")),
            ("a_m_per_s2", Measurand::Acceleration, Some("m/s²")),
            ("v_mm_per_s", Measurand::Velocity, Some("mm/s")),
            ("M_N_m", Measurand::Force, Some("N m")),
            ("y", Measurand::Displacement, None),
            ("mm", Measurand::Displacement, None),
            ("y_raw", Measurand::Displacement, None),
            ("Acc_g_filtered", Measurand::Acceleration, Some("g")),
            ("Accel_gs", Measurand::Acceleration, Some("g")),
            ("force_N_2", Measurand::Force, Some("N")),
            ("y_mm", Measurand::Time, None),
        ] {
            let table = table(&format!("{name},z\n1,2\n2,3\n"));
            let unit = table.stated_unit(0).suffix(kind);
            assert_eq!(unit.as_ref().map(Unit::symbol), symbol, "{name}");
        }
    }

    #[test]
    fn contradictions_are_found() {
        let is_refused = |header: &str, unit: &str| {
            let table = table(&format!("t,{header}\ns,{unit}\n0,1\n1,2\n"));
            assert_eq!(table.units_row().len(), 2, "{header} {unit}");
            table.check_stated_unit(1).is_err()
        };
        for (header, unit) in [
            ("y [mm]", "m"),
            ("y (m/s²)", "m"),
            ("y / mm", "[m]"),
            ("phi [deg]", "rad"),
        ] {
            assert!(is_refused(header, unit), "{header} {unit}");
        }
        for (header, unit) in [
            ("y [mm]", "mm"),
            ("y (left)", "m"),
            ("y [mm]", "-"),
            ("y [mm]", ""),
            ("y", "m"),
            ("a [m/s^2]", "m/s²"),
        ] {
            assert!(!is_refused(header, unit), "{header} {unit}");
        }
    }
}
