//! Candidates in words.

use super::Candidate;
use super::addition::Addition;
use crate::alternatives::RecordParameter;
use crate::identifiability::Quantity;
use crate::number_format::{and_list, significant};
use crate::problem::Problem;

impl Addition {
    /// Name in files: what is added, and to what.
    pub(super) fn name(self, problem: &Problem) -> String {
        let function = |f: usize| problem.functions.get(f).name();
        match self {
            Self::Term(kind, _) => kind.name().to_owned(),
            Self::Variation { function: f, .. } => format!("{} that varies", function(f)),
            Self::FinerBasis { function: f, .. } => format!("finer basis of {}", function(f)),
            Self::Jump { function: f, .. } => format!("jump of {}", function(f)),
            Self::Record(parameter) => {
                let (e, c) = match parameter {
                    RecordParameter::Delay(e) | RecordParameter::Rate(e) => (e, None),
                    RecordParameter::Gain(e, c)
                    | RecordParameter::Offset(e, c)
                    | RecordParameter::Drift(e, c) => (e, Some(c)),
                };
                let name = parameter.name();
                match c {
                    Some(c) => format!("{name} of {}", channel(problem, e, c)),
                    None => format!("{name} of {}", problem.experiments[e].name),
                }
            }
            Self::InputPulses { .. } => "wrong samples of the force".to_owned(),
            Self::CubicInputs => "cubic interpolation of the inputs".to_owned(),
            Self::Disturbance { experiment: e } => {
                format!("disturbance of {}", problem.experiments[e].name)
            }
            Self::SensorCurve {
                experiment: e,
                channel: c,
            } => format!("curved sensor of {}", channel(problem, e, c)),
            Self::Tone {
                experiment: e,
                channel: c,
                frequency,
            } => format!("tone of {frequency} Hz in {}", channel(problem, e, c)),
            Self::SecondMode {
                experiment: e,
                channel: c,
                ..
            } => format!("second mode in {}", channel(problem, e, c)),
        }
    }

    /// What is added in a sentence, with its article and estimates.
    pub(super) fn words(self, problem: &Problem, estimates: &[Quantity]) -> String {
        let function = |f: usize| problem.functions.get(f).name().replace('_', " ");
        let stated = |i: usize, digits: usize| {
            let quantity = estimates.get(i)?;
            let unit = quantity.unit.as_str();
            let space = if unit.is_empty() { "" } else { " " };
            Some(format!(
                "{}{space}{unit}",
                significant(quantity.value, digits)
            ))
        };
        let of = |i: usize| stated(i, 3).map_or(String::new(), |value| format!(" of {value}"));
        match self {
            Self::Term(kind, _) => format!("{}{}", kind.row().words, of(0)),
            Self::Variation { function: f, .. } => match (stated(0, 4), stated(1, 4)) {
                (Some(first), Some(last)) => format!(
                    "a {} that varies with time ({first} at the beginning, {last} at the end)",
                    function(f)
                ),
                _ => format!("a {} that varies with time", function(f)),
            },
            Self::FinerBasis { function: f, .. } => format!("a finer basis of the {}", function(f)),
            Self::Jump { function: f, .. } => match (stated(0, 4), stated(1, 4), stated(2, 4)) {
                (Some(time), Some(before), Some(after)) => format!(
                    "a jump of the {} at {time} from {before} to {after}",
                    function(f)
                ),
                _ => format!("a jump of the {}", function(f)),
            },
            Self::Record(parameter) => match parameter {
                RecordParameter::Delay(_) => format!("a delay of the response{}", of(0)),
                RecordParameter::Rate(_) => {
                    let value = estimates.first().map_or(f64::NAN, |q| 100.0 * q.value);
                    let value = significant(value, 2);
                    format!("a difference of {value} % between the clocks of input and response")
                }
                RecordParameter::Gain(e, c) => {
                    format!("a gain of the {}{}", channel(problem, e, c), of(0))
                }
                RecordParameter::Offset(e, c) => {
                    format!("an offset of the {}{}", channel(problem, e, c), of(0))
                }
                RecordParameter::Drift(e, c) => {
                    format!("a drift of the {}{}", channel(problem, e, c), of(0))
                }
            },
            Self::InputPulses { count: 1, time, .. } => {
                format!("a wrong sample of the force at {} s", significant(time, 4))
            }
            Self::InputPulses { count, time, .. } => format!(
                "{count} wrong samples of the force, the largest error at {} s",
                significant(time, 4)
            ),
            Self::CubicInputs => "cubic splines between the samples of the inputs".to_owned(),
            Self::Disturbance { .. } => {
                "a disturbance that enters through the equation of motion".to_owned()
            }
            Self::SensorCurve {
                experiment: e,
                channel: c,
            } => format!(
                "a curved characteristic of the sensor of the {}",
                channel(problem, e, c)
            ),
            Self::Tone {
                experiment: e,
                channel: c,
                frequency,
            } => format!("a tone of {frequency} Hz in the {}", channel(problem, e, c)),
            Self::SecondMode { mode, .. } => {
                format!("a second mode at {} Hz", significant(mode[0], 3))
            }
        }
    }
}

impl Candidate {
    /// The candidate in a sentence.
    pub(super) fn in_words(&self, problem: &Problem) -> String {
        let each = self.additions.iter();
        let estimates = match self.additions.len() {
            1 => self.estimates.as_slice(),
            _ => &[],
        };
        let parts: Vec<String> = each.map(|a| a.words(problem, estimates)).collect();
        match (self.to_constants, parts.is_empty()) {
            (false, _) => and_list(&parts),
            (true, true) => "constants in place of functions that vary".to_owned(),
            (true, false) => format!(
                "constants with {} in place of functions that vary",
                and_list(&parts)
            ),
        }
    }
}

/// Kind of a channel, with its record where there are several.
fn channel(problem: &Problem, e: usize, c: usize) -> String {
    let experiment = &problem.experiments[e];
    let kind = experiment.channels[c].kind().name();
    match problem.experiments.len() {
        1 => kind.to_owned(),
        _ => format!("{kind} of {}", experiment.name),
    }
}
