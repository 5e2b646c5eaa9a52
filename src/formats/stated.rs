//! What attributes, properties, small variables and lines state of the samples beside them: units, scales and clocks are applied, others
//! named.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};

use super::names::{Meaning, Name, factor_of_rate, factor_of_time, is_generic, letters, read};
use super::{Channels, FileChannel, Sampling, clocks, last_part};
use crate::clock::Clock;
use crate::headings::split_unit;
use crate::quantity_names::quantity_of;
use crate::units::{Measurand, Unit};

/// Most numbers of a variable that states something.
const SMALL: usize = 16;
/// Words of the names of what is added to samples or times.
const OFFSETS: &str = "offset intercept bias delay lag latency skew drift";
/// Most values that a message lists.
const LISTED: usize = 4;

/// A statement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Fact {
    /// As spelt in the file.
    text: String,
    name: Name,
    pub values: Vec<String>,
}

impl Fact {
    /// `None` where the name means nothing.
    pub fn new(name: &str, values: Vec<String>) -> Option<Self> {
        let read = read(name).filter(|_| !values.is_empty())?;
        Some(Self {
            text: name.to_owned(),
            name: read,
            values,
        })
    }

    pub fn meaning(&self) -> Meaning {
        self.name.meaning
    }

    /// The statement for member i of several: its own value.
    pub fn of_member(&self, i: usize) -> Option<Self> {
        let values = vec![self.values.get(i)?.clone()];
        Some(Self {
            values,
            ..self.clone()
        })
    }

    /// The first value as a number, and the text behind it.
    fn number(&self) -> Option<(f64, &str)> {
        let text = self.text();
        let (number, rest) = text.split_once(' ').unwrap_or((text, ""));
        let number: f64 = number.parse().ok()?;
        number.is_finite().then_some((number, rest.trim()))
    }

    /// True if a sentence on what is not applied is on this.
    pub fn states(&self, sentence: &str) -> bool {
        sentence == self.in_words()
    }

    /// The first value.
    fn text(&self) -> &str {
        self.values.first().map_or("", |value| value.trim())
    }

    /// The number in Hz or s: in the unit of its name, in its own, or in that stated beside it. Of a date the seconds since 1970.
    fn si(&self, beside: &str) -> Option<f64> {
        let Some((number, own)) = self.number() else {
            let is_begin = self.name.meaning == Meaning::Begin;
            return Clock::read(self.text(), false)
                .filter(|_| is_begin)
                .map(|clock| clock.absolute());
        };
        let unit = if own.is_empty() { beside } else { own };
        let factor = match (self.name.factor, self.name.meaning) {
            (Some(factor), _) if own.is_empty() => Some(factor),
            _ if unit.is_empty() => Some(1.0),
            (_, Meaning::Rate) => factor_of_rate(unit),
            _ => factor_of_time(unit),
        };
        Some(factor? * number)
    }

    fn in_words(&self) -> String {
        let listed = self.values.iter().take(LISTED).cloned().collect::<Vec<_>>();
        let (name, listed) = (&self.text, listed.join(", "));
        match self.values.len() {
            1 => format!("{name} = {listed}"),
            2..=LISTED => format!("{name} = [{listed}]"),
            _ => format!("{name} = [{listed}, …]"),
        }
    }

    /// True for factors of 1 and offsets of 0.
    fn is_neutral(&self) -> bool {
        let numbers = self
            .values
            .iter()
            .map(|value| value.trim().parse().unwrap_or(f64::NAN));
        let count = |of: f64| numbers.clone().filter(|x| *x == of).count();
        let (ones, zeros, all) = (count(1.0), count(0.0), self.values.len());
        let small = self.text.to_lowercase();
        let is_offset = OFFSETS.split(' ').any(|word| small.contains(word));
        ones == all || is_offset && zeros == all || ones == 1 && zeros + 1 == all
    }
}

/// Samples of which something is stated.
pub(crate) struct Subject<'a> {
    pub name: &'a str,
    pub quantity: Option<Measurand>,
    /// Letters of the names of all samples.
    pub all: &'a BTreeSet<String>,
    /// True for a format that defines `scale_factor` and `add_offset`.
    pub has_scales: bool,
}

/// What is stated of some samples.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Outcome {
    pub unit: Option<String>,
    pub factor: Option<f64>,
    pub offset: Option<f64>,
    pub step: Option<f64>,
    pub start: Option<f64>,
    /// Time of the first sample that counts only relative to that of others, s; and its statement.
    begin: Option<(f64, String)>,
    /// Statements that are not applied.
    pub unapplied: Vec<String>,
    /// The variable, or the attribute of a group, that states the interval.
    source: Option<String>,
}

/// Whose samples a statement concerns.
#[derive(Clone, Copy, PartialEq)]
enum Of {
    These,
    All,
    Others,
    /// Those of a name that is not known.
    Unknown,
}

impl Subject<'_> {
    fn of(&self, name: &Name) -> Of {
        let subject = name.subject.as_str();
        match quantity_of(subject).filter(|_| !is_generic(subject)) {
            _ if subject.is_empty() => Of::All,
            _ if subject == letters(self.name) => Of::These,
            _ if self.all.contains(subject) => Of::Others,
            Some(own) if self.quantity == Some(own) => Of::These,
            Some(_) => Of::Others,
            None if is_generic(subject) => Of::All,
            None => Of::Unknown,
        }
    }

    /// What statements say of these samples: those of groups first, each with true where it stands at the samples themselves.
    pub fn outcome<'f>(&self, facts: impl Iterator<Item = (&'f Fact, bool)> + Clone) -> Outcome {
        let mut found = Outcome::default();
        let mut described = None;
        // Statements that matter only without a better one.
        let mut unclear = Vec::new();
        let unit_of = |meaning: Meaning| {
            let last = facts
                .clone()
                .filter(|(fact, _)| fact.name.meaning == meaning)
                .last();
            last.map_or("", |(fact, _)| fact.text())
        };
        let is_time = self.quantity == Some(Measurand::Time);
        let concerned = facts
            .clone()
            .map(|(fact, is_near)| (fact, is_near, self.of(&fact.name)));
        for (fact, is_near, of) in concerned {
            let text = fact.text();
            let is_none = ["", "-", "none"].contains(&&*text.to_lowercase());
            match fact.name.meaning {
                Meaning::UnitOfTimes if is_time && !is_none => found.unit = Some(text.to_owned()),
                _ if of == Of::Others => {}
                Meaning::Unit if is_none || text.parse::<f64>().is_ok() => {}
                Meaning::Unit if fact.values.len() > 1 => unclear.push(fact),
                Meaning::Unit if of == Of::These || is_near => found.unit = Some(text.to_owned()),
                Meaning::Unit if of == Of::Unknown || Unit::any(text).is_none() => {
                    unclear.push(fact);
                }
                Meaning::Unit if self.fits(text) => found.unit = Some(text.to_owned()),
                Meaning::Description if is_near => {
                    let unit = split_unit(text).1.filter(|unit| self.fits(unit));
                    described = described.or(unit.map(str::to_owned));
                }
                Meaning::Factor | Meaning::Offset if self.has_scales && fact.values.len() == 1 => {
                    let position = match fact.name.meaning {
                        Meaning::Factor => &mut found.factor,
                        _ => &mut found.offset,
                    };
                    *position = fact.number().map(|(number, _)| number);
                }
                Meaning::Factor | Meaning::Offset | Meaning::Unapplied if is_near || !is_time => {
                    let is_scale = fact.number().is_some() && !fact.is_neutral();
                    found.unapplied.extend(is_scale.then(|| fact.in_words()));
                }
                Meaning::Rate | Meaning::Interval | Meaning::Start | Meaning::Begin => {
                    let beside = match fact.name.meaning {
                        Meaning::Rate => unit_of(Meaning::UnitOfRate),
                        _ => unit_of(Meaning::UnitOfTimes),
                    };
                    match fact.si(beside) {
                        Some(_) if of == Of::Unknown && !is_near => unclear.push(fact),
                        Some(value) => found.state_clock(fact, value, is_near),
                        None if fact.number().is_some() => {
                            found
                                .unapplied
                                .push(format!("{} {beside}", fact.in_words()).trim().to_owned());
                            let value = fact.si("").filter(|_| !beside.is_empty());
                            value
                                .into_iter()
                                .for_each(|value| found.state_clock(fact, value, is_near));
                        }
                        None => {}
                    }
                }
                _ => {}
            }
        }
        found.unit = found.unit.or(described);
        let is_better = |fact: &Fact| match fact.name.meaning {
            Meaning::Unit => found.unit.is_some() || is_time && fact.values.len() == 1,
            _ => found.step.is_some() || is_time,
        };
        let unclear = unclear.into_iter().filter(|fact| !is_better(fact));
        found
            .unapplied
            .extend(unclear.map(Fact::in_words).collect::<Vec<_>>());
        found
    }

    /// True for a unit that can be that of the samples.
    fn fits(&self, unit: &str) -> bool {
        match self.quantity {
            Some(quantity) => Unit::recognise(quantity, unit).is_some(),
            None => Unit::any(unit).is_some_and(|unit| !unit.is_of(Measurand::Time)),
        }
    }
}

impl Outcome {
    /// Takes a rate (Hz), an interval or a time (s).
    fn state_clock(&mut self, fact: &Fact, value: f64, is_near: bool) {
        match fact.name.meaning {
            Meaning::Start => self.start = Some(value),
            Meaning::Begin => self.begin = Some((value, fact.in_words())),
            _ if value <= 0.0 => {}
            meaning => {
                self.step = Some(if meaning == Meaning::Rate {
                    1.0 / value
                } else {
                    value
                });
                self.source = (!is_near).then(|| fact.text.clone());
            }
        }
    }
}

impl Channels {
    /// States something of the channels from a place on: one value for each, or all for all.
    pub(super) fn state(&mut self, from: usize, name: &str, values: Vec<String>) {
        let Some(fact) = Fact::new(name, values) else {
            return;
        };
        let members = self.channels.get_mut(from..).unwrap_or_default();
        let count = members.len();
        // `FIELD_1_UNIT` of PyTables.
        let field = fact
            .name
            .subject
            .strip_prefix("field")
            .and_then(|i| i.parse::<usize>().ok());
        for (i, member) in members.iter_mut().enumerate() {
            let own = match count > 1 && fact.values.len() == count {
                true => fact.of_member(i),
                false => Some(fact.clone()).filter(|_| field.is_none_or(|field| field == i)),
            };
            member.stated.extend(own);
        }
    }

    /// States something of the channels of a group, `""` for the file.
    pub(super) fn state_group(&mut self, group: &str, name: &str, values: Vec<String>) {
        let fact = Fact::new(name, values.clone());
        let (outer, own) = group.rsplit_once('.').unwrap_or(("", group));
        match fact {
            Some(fact) => self.groups.entry(group.to_owned()).or_default().push(fact),
            // `units.acc`, and the cells of `units`.
            None if read(own).is_some() => {
                let known = self.groups.entry(outer.to_owned()).or_default();
                match (
                    name.parse::<usize>(),
                    known.iter_mut().find(|fact| fact.text == own),
                ) {
                    (Ok(_), Some(fact)) => fact.values.extend(values),
                    (Ok(_), None) => known.extend(Fact::new(own, values)),
                    (Err(_), _) => known.extend(Fact::new(&format!("{name}_{own}"), values)),
                }
            }
            None => {}
        }
    }

    /// Applies what the file states to its channels.
    pub(super) fn apply_statements(&mut self, has_scales: bool) {
        self.state_variables();
        let timed = clocks::timed(&self.channels);
        let mut begins = vec![None; self.channels.len()];
        let is_silent = self.groups.is_empty() && self.channels.iter().all(|c| c.stated.is_empty());
        if !is_silent {
            let sources = self.apply_facts(has_scales, &timed, &mut begins);
            let notes = sources
                .iter()
                .map(|name| format!("sampling rate from `{name}`"));
            self.notes.extend(notes);
        }
        clocks::begin_at(&mut self.channels, &begins, &timed);
        // Times in the file take precedence over a rate.
        let is_timed = |c: &&mut FileChannel| timed.contains(&c.values.len());
        for channel in self.channels.iter_mut().filter(is_timed) {
            channel.stated_step = channel.sampling.take().map(Sampling::step);
        }
        clocks::own_times(&mut self.channels);
        self.notes.extend(clocks::align(&mut self.channels));
    }

    /// Returns the names that state rates of several channels.
    fn apply_facts(
        &mut self,
        has_scales: bool,
        timed: &BTreeSet<usize>,
        begins: &mut [Option<(f64, String)>],
    ) -> BTreeSet<String> {
        let has_samples = |c: &&FileChannel| c.values.len() > 1;
        let names = self.channels.iter().filter(has_samples);
        let all = names.map(|c| letters(last_part(&c.name))).collect();
        let mut columns = BTreeMap::<String, usize>::new();
        for (array, _) in self.channels.iter().filter_map(|c| column(&c.name)) {
            *columns.entry(array.to_owned()).or_default() += 1;
        }
        let mut sources = BTreeSet::new();
        let channels = self.channels.iter_mut().zip(begins);
        for (channel, begin) in channels.filter(|(c, _)| c.values.len() > 1) {
            let name = channel.name.as_str();
            let ends = name.match_indices('.').filter_map(|(at, _)| name.get(..at));
            let of_groups = std::iter::once("")
                .chain(ends)
                .filter_map(|group| self.groups.get(group));
            // One value for each column of an array.
            let own = column(name).map(|(array, i)| (columns.get(array).copied(), i));
            let of_column = |fact: &'_ Fact| {
                let (_, i) = own.filter(|(count, _)| *count == Some(fact.values.len()))?;
                fact.of_member(i)
            };
            let of_groups = of_groups.flatten().filter(|fact| fact.text != name);
            let of_groups: Vec<Cow<Fact>> = of_groups
                .map(|fact| of_column(fact).map_or(Cow::Borrowed(fact), Cow::Owned))
                .collect();
            let subject = Subject {
                name: last_part(name),
                // The letter of `X.Data` is the name of an axis of a plot.
                quantity: quantity_of(last_part(name))
                    .or_else(|| quantity_of(name).filter(|_| name.find('.') != Some(1))),
                all: &all,
                has_scales,
            };
            let of_groups = of_groups.iter().map(|fact| (fact.as_ref(), false));
            let found =
                subject.outcome(of_groups.chain(channel.stated.iter().map(|fact| (fact, true))));
            channel.unit = channel.unit.take().or(found.unit);
            if found.factor.is_some() || found.offset.is_some() {
                // Without a scale no digit changes.
                let (factor, offset) = (found.factor.unwrap_or(1.0), found.offset.unwrap_or(0.0));
                let values = channel.values.iter_mut();
                values.for_each(|x| *x = factor * *x + offset);
            }
            if channel.sampling.is_none() {
                let start = found.start.unwrap_or(0.0);
                channel.sampling = found.step.and_then(|step| Sampling::interval(start, step));
                let is_timed = timed.contains(&channel.values.len());
                sources.extend(found.source.filter(|_| !is_timed));
            }
            channel.unapplied.extend(found.unapplied);
            *begin = found.begin;
        }
        sources
    }

    /// Variables of few numbers state something where their names mean something.
    fn state_variables(&mut self) {
        let longest = self.channels.iter().map(|c| c.values.len()).max();
        let longest = longest.unwrap_or(0).max(8);
        let is_small = |c: &&FileChannel| c.values.len() <= SMALL && 4 * c.values.len() < longest;
        let is_meant = |path: &str| {
            let (group, name) = path.rsplit_once('.').unwrap_or(("", path));
            read(name).is_some() || read(last_part(group)).is_some()
        };
        let found: Vec<(String, Vec<String>)> = (self.channels.iter())
            .filter(|c| is_small(c) && is_meant(&c.name))
            .map(|c| {
                (
                    c.name.clone(),
                    c.values.iter().map(ToString::to_string).collect(),
                )
            })
            .collect();
        for (path, values) in found {
            let (group, name) = path.rsplit_once('.').unwrap_or(("", &path));
            self.state_group(group, name, values);
        }
    }
}

/// The array of a column `array.2` and its place in it.
fn column(name: &str) -> Option<(&str, usize)> {
    let (array, number) = name.rsplit_once('.')?;
    Some((array, number.parse::<usize>().ok()?.checked_sub(1)?))
}
