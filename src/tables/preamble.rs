//! What the lines beside the names and rows of a text state of its columns: units, scales, and a sampling rate.

use std::collections::BTreeSet;

use super::Table;
use super::detect::DELIMITERS;
use crate::formats::{Fact, Meaning, Subject, letters, meaning};
use crate::headings::split_unit;
use crate::quantity_names::quantity_of;
use crate::units::{Measurand, Unit, unbracketed};

/// Longest line that states something in words, letters.
const LONGEST: usize = 60;

impl Table {
    /// Takes from the lines before the rows what they state of columns that do not state it themselves.
    pub(super) fn state_by_preamble(&mut self, text: &str, delimiter: char) {
        let before = self.lines.first().map_or(0, |line| line.saturating_sub(1));
        let format = self.text_format();
        let own = format.map_or([None, None], |format| [format.header, format.units_row]);
        let lines = text.lines().enumerate().take(before);
        let mut lines = lines
            .filter(|(i, _)| !own.contains(&Some(i + 1)))
            .map(|(_, line)| line)
            .peekable();
        let mut facts = Vec::new();
        while let Some(line) = lines.next() {
            facts.extend(of_line(line, lines.peek().copied(), delimiter));
        }
        let width = self.width();
        let names: Vec<String> = (0..width)
            .map(|i| split_unit(self.quantity_name(i)).0.to_owned())
            .collect();
        let all: BTreeSet<String> = names.iter().map(|name| letters(name)).collect();
        let has_key = names
            .first()
            .is_some_and(|name| quantity_of(name) == Some(Measurand::Time))
            || self
                .columns
                .first()
                .is_some_and(|column| column.samples.iter().all(|x| x.is_nan()));
        let is_named = !self.headers.is_empty();
        for (i, name) in names.iter().enumerate() {
            // One value for each column, or for each but that of the times.
            let of_column = |fact: &Fact| match fact.values.len() {
                1 => Some(fact.clone()),
                count if count == width => fact.of_member(i),
                count if count + 1 == width && has_key => fact.of_member(i.checked_sub(1)?),
                _ => Some(fact.clone()),
            };
            let own: Vec<Fact> = facts.iter().filter_map(of_column).collect();
            let subject = Subject {
                name,
                quantity: quantity_of(name),
                all: &all,
                has_scales: false,
            };
            let found = subject.outcome(own.iter().map(|fact| (fact, false)));
            let stated = self.stated_unit(i);
            let in_name = |kind| stated.suffix(kind).or(stated.last_word(kind)).is_some();
            let is_stated = stated.text().is_some() || subject.quantity.is_some_and(in_name);
            if let Some(unit) = found.unit.filter(|_| !is_stated && (is_named || width > 1)) {
                self.state_unit(i, &unit);
            }
            let is_unit = |text: &String| {
                facts
                    .iter()
                    .any(|fact| fact.meaning() == Meaning::Unit && fact.states(text))
            };
            let column = &mut self.columns[i];
            column.unapplied.extend(
                found
                    .unapplied
                    .into_iter()
                    .filter(|text| !is_stated || !is_unit(text)),
            );
            self.stated_step = self.stated_step.or(found.step);
        }
    }
}

/// What a line states, with the next one: `Sampling rate: 500 Hz`, `Units,s,N,g`, `# acceleration in g`.
fn of_line(line: &str, next: Option<&str>, delimiter: char) -> Vec<Fact> {
    let is_sign = |c: char| c.is_whitespace() || "#;%\",[]()!".contains(c);
    let line = line.trim_matches(|c: char| is_sign(c) && !"[]()".contains(c));
    let parted = line.split_once([':', '=', '\t', ';', ',']);
    let (name, value) = match parted {
        Some((name, "")) => (
            name,
            next.and_then(|next| next.split('\t').next())
                .unwrap_or_default(),
        ),
        Some(found) => found,
        None => return in_words(line),
    };
    let (name, unit) = name.split_once(['(', '[']).unwrap_or((name, ""));
    let name = name.trim_matches(is_sign);
    match meaning(name) {
        None | Some(Meaning::Description) => in_words(value),
        Some(Meaning::Rate | Meaning::Interval | Meaning::Start) => {
            let value = value.trim_start_matches(is_sign);
            let end = value.find(|c: char| !(c.is_ascii_digit() || ".eE+-".contains(c)));
            let (number, behind) = value.split_at(end.unwrap_or(value.len()));
            // The number can stand once for each channel.
            let unit = [unit, behind].map(|text| {
                text.split(is_sign)
                    .find(|word| !word.is_empty() && *word != number)
            });
            let unit = unit.into_iter().flatten().next().unwrap_or_default();
            Fact::new(name, vec![format!("{number} {unit}").trim().to_owned()])
                .into_iter()
                .collect()
        }
        Some(Meaning::Unit) => units(name, value, delimiter),
        Some(_) => {
            let fields = value
                .split([delimiter, ',', ';', '\t'])
                .map(|field| field.trim_matches(['"', ' ']));
            let fields = fields.filter(|field| !field.is_empty()).map(str::to_owned);
            Fact::new(name, fields.collect()).into_iter().collect()
        }
    }
}

/// `s, N, g` and `time ms, force N`; nothing without a unit.
fn units(name: &str, value: &str, delimiter: char) -> Vec<Fact> {
    let is_unit = |text: &str| text == "-" || Unit::any(unbracketed(text)).is_some();
    for sign in std::iter::once(delimiter).chain(DELIMITERS) {
        let fields = value
            .split(sign)
            .map(|field| field.trim().trim_matches('"').trim());
        let fields: Vec<&str> = fields
            .filter(|field| sign != ' ' || !field.is_empty())
            .collect();
        if fields.iter().all(|field| is_unit(field)) {
            let values = fields.iter().map(|field| unbracketed(field).to_owned());
            return Fact::new(name, values.collect()).into_iter().collect();
        }
        let pair = |field: &&str| {
            let (of, unit) = field.rsplit_once([' ', ':', '='])?;
            is_unit(unit).then(|| {
                Fact::new(
                    &format!("{} unit", of.trim()),
                    vec![unbracketed(unit).to_owned()],
                )
            })?
        };
        if let Some(pairs) = fields.iter().map(pair).collect::<Option<Vec<Fact>>>() {
            return pairs;
        }
    }
    let fields = value
        .split([delimiter, ',', ';', '\t', ' '])
        .map(|field| field.trim_matches(['"', ' ']));
    let fields: Vec<String> = fields
        .filter(|field| !field.is_empty())
        .map(str::to_owned)
        .collect();
    // The number of a device is no unit.
    match fields.iter().any(|field| is_unit(field)) {
        true => Fact::new(name, fields).into_iter().collect(),
        false => Vec::new(),
    }
}

/// `acceleration in g`.
fn in_words(line: &str) -> Vec<Fact> {
    let (name, unit) = split_unit(line.trim());
    let quantity =
        quantity_of(name).filter(|_| line.contains(" in ") && line.chars().count() <= LONGEST);
    let unit =
        unit.filter(|unit| quantity.is_some_and(|kind| Unit::recognise(kind, unit).is_some()));
    let fact = unit.and_then(|unit| Fact::new(&format!("{name} unit"), vec![unit.to_owned()]));
    fact.into_iter().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(before: &str, names: &str) -> Table {
        let text = format!("{before}\n{names}\n0,1,2\n1,2,4\n2,4,8\n");
        Table::parse("t.csv", text.as_bytes()).expect("a table")
    }

    #[test]
    fn lines_state_rates() {
        for (line, rate) in [
            ("Sampling rate: 500 Hz", 500.0),
            ("# fs = 500", 500.0),
            ("SAMPLING_RATE;500Hz", 500.0),
            (";SampleRate, 500,Hz", 500.0),
            ("Sample interval (ms)\t2.0", 500.0),
            ("Sample interval (s),0.002,0.002", 500.0),
            ("Sampling frequency [kHz]: 0.5", 500.0),
            ("dt:\t\n0.002\t0.002", 500.0),
        ] {
            assert_eq!(table(line, "a,b,c").stated_rate(), Some(rate), "{line}");
        }
        for line in ["Sampling rate: fast", "Rate: 1,000 Hz", "rate of change: 3"] {
            assert_eq!(table(line, "a,b,c").stated_rate(), None, "{line}");
        }
    }

    #[test]
    fn lines_state_units_and_scales() {
        for (line, units) in [
            ("# Units: s, kN, g", ["s", "kN", "g"]),
            ("# units: kN, g", ["", "kN", "g"]),
            ("\"Units\",\"kN\",\"g\"", ["", "kN", "g"]),
            ("# units: time ms, force N, acc g", ["ms", "N", "g"]),
            ("# acceleration in g", ["", "", "g"]),
            ("# acceleration unit: g", ["", "", "g"]),
            ("Time unit: ms", ["ms", "", ""]),
            ("Unit: 7", ["", "", ""]),
            ("Unit: DAQ 3", ["", "", ""]),
        ] {
            let table = table(line, "time,force,acc");
            let found: Vec<&str> = (0..3).map(|i| table.unit(i).unwrap_or_default()).collect();
            assert_eq!(found, units, "{line}");
            assert!((0..3).all(|i| table.unapplied(i).is_empty()), "{line}");
        }
        for (line, column, text) in [
            ("Scale factor: 2", 1, "Scale factor = 2"),
            ("units: kN, g, mm, V", 2, "units = [kN, g, mm, V]"),
            (
                "sensitivity of acc: 100 mV/g",
                2,
                "sensitivity of acc = 100 mV/g",
            ),
            ("sampling rate: 30 per minute", 1, "sampling rate = 30 per"),
        ] {
            let table = table(line, "time,force,acc");
            assert_eq!(table.unapplied(column), [text], "{line}");
        }
    }
}
