//! Comparison of stored documents and tables with those computed again.

use crate::report::csv::CsvTable;
use crate::report::result_table::ResultTable;
use serde::Serialize;
use serde_json::Value;

/// Largest relative difference of a number that holds. The recomputation has the operations of the fit, so that it differs by rounding
/// alone; the smallest edit that must be found is 1e-6.
pub const TOLERANCE: f64 = 1e-7;
/// Difference beside the largest number of a column that is rounding.
const ROUNDING: f64 = 1e-14;

/// Keys whose values are prose, times or paths.
const PROSE: [&str; 10] = [
    "version",
    "title",
    "text",
    "reason",
    "passed",
    "whiteness",
    "remark",
    "cost_definition",
    "file",
    "failure",
];

/// A stored value that the recomputation does not confirm.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Difference {
    /// File in the folder of the run.
    pub file: String,
    /// Place in the file: a JSON pointer, or column and row.
    pub place: String,
    /// Stored value.
    pub stored: String,
    /// Recomputed value.
    pub recomputed: String,
}

/// Values of one file that were compared.
#[derive(Debug, Default)]
pub struct Comparison {
    /// Number of values.
    pub count: usize,
    /// Largest relative difference of numbers that hold.
    pub largest: f64,
    /// Values that do not hold.
    pub differences: Vec<Difference>,
}

impl Comparison {
    /// Adds the values of another file.
    pub fn add(&mut self, other: Self) {
        self.count += other.count;
        self.largest = self.largest.max(other.largest);
        self.differences.extend(other.differences);
    }

    /// Compares the values of two JSON documents, except those below the pointers `left_out`; numbers in `floors` hold within that
    /// absolute difference too.
    pub fn of_json(
        file: &str,
        [stored, fresh]: [&Value; 2],
        left_out: &[&str],
        floor: &dyn Fn(&str) -> f64,
    ) -> Self {
        let mut found = Self::default();
        let rules = Rules {
            file,
            left_out,
            floor,
        };
        found.values(&rules, String::new(), Some(stored), Some(fresh));
        found
    }

    fn values(
        &mut self,
        rules: &Rules,
        place: String,
        stored: Option<&Value>,
        fresh: Option<&Value>,
    ) {
        let key = place.rsplit('/').next().unwrap_or_default();
        if rules.left_out.contains(&place.as_str()) || PROSE.contains(&key) {
            return;
        }
        match (stored, fresh) {
            (Some(Value::Object(a)), Some(Value::Object(b))) => {
                let more = b.keys().filter(|key| !a.contains_key(*key));
                for key in a.keys().chain(more) {
                    let escaped = key.replace('~', "~0").replace('/', "~1");
                    self.values(rules, format!("{place}/{escaped}"), a.get(key), b.get(key));
                }
            }
            (Some(Value::Array(a)), Some(Value::Array(b))) => {
                for i in 0..a.len().max(b.len()) {
                    self.values(rules, format!("{place}/{i}"), a.get(i), b.get(i));
                }
            }
            _ => self.value(rules, &place, stored, fresh),
        }
    }

    fn value(&mut self, rules: &Rules, place: &str, stored: Option<&Value>, fresh: Option<&Value>) {
        self.count += 1;
        let holds = match (
            stored.and_then(Value::as_f64),
            fresh.and_then(Value::as_f64),
        ) {
            (Some(a), Some(b)) => self.number(a, b, (rules.floor)(place)),
            _ => stored == fresh,
        };
        if !holds {
            let shown = |value: Option<&Value>| match value {
                None => "none".to_owned(),
                Some(value) => value.to_string().chars().take(60).collect(),
            };
            self.differences.push(Difference {
                file: rules.file.to_owned(),
                place: place.to_owned(),
                stored: shown(stored),
                recomputed: shown(fresh),
            });
        }
    }

    /// True if two numbers are equal within [`TOLERANCE`] or `floor`.
    fn number(&mut self, stored: f64, fresh: f64, floor: f64) -> bool {
        let off = (stored - fresh).abs();
        if off <= floor {
            return true;
        }
        let relative = off / stored.abs().max(fresh.abs());
        let holds = relative <= TOLERANCE;
        if holds {
            self.largest = self.largest.max(relative);
        }
        holds
    }

    /// Compares a table with the stored one.
    pub fn of_table(file: &str, stored: &ResultTable, fresh: &CsvTable) -> Self {
        let mut found = Self::default();
        let difference = |place: String, stored: String, recomputed: String| Difference {
            file: file.to_owned(),
            place,
            stored,
            recomputed,
        };
        if stored.headers() != fresh.headers() {
            let [a, b] = [stored.headers(), fresh.headers()].map(|names| names.join(","));
            found
                .differences
                .push(difference("column names".into(), a, b));
            return found;
        }
        for (name, fresh) in fresh.headers().iter().zip(fresh.columns()) {
            let stored = stored.column(name).unwrap_or_default();
            let finite = fresh.iter().filter(|x| x.is_finite());
            let size = finite.fold(0.0f64, |most, x| most.max(x.abs()));
            for row in 0..stored.len().max(fresh.len()) {
                let at = |list: &[f64]| list.get(row).copied().filter(|x| x.is_finite());
                let (a, b) = (at(&stored), at(fresh));
                found.count += 1;
                let holds = match (a, b) {
                    (Some(a), Some(b)) => found.number(a, b, ROUNDING * size),
                    _ => a.is_some() == b.is_some(),
                };
                if !holds {
                    let shown = |x: Option<f64>| x.map_or("none".to_owned(), |x| x.to_string());
                    let place = format!("column {name}, row {}", row + 1);
                    found
                        .differences
                        .push(difference(place, shown(a), shown(b)));
                }
            }
        }
        found
    }
}

/// File and exceptions of a comparison.
struct Rules<'a> {
    file: &'a str,
    left_out: &'a [&'a str],
    floor: &'a dyn Fn(&str) -> f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn differences(stored: Value, fresh: Value) -> Vec<String> {
        let none = |_: &str| 0.0;
        let found = Comparison::of_json("a.json", [&stored, &fresh], &["/seconds"], &none);
        found.differences.into_iter().map(|d| d.place).collect()
    }

    #[test]
    fn numbers_differ_beyond_the_tolerance_and_prose_does_not() {
        let fresh = json!({"cost": {"final": 1.0}, "list": [1.0, null], "text": "a", "seconds": 1.0, "status": "estimated"});
        let same = json!({"cost": {"final": 1.0 + 1e-10}, "list": [1.0, null], "text": "b", "seconds": 2.0, "status": "estimated"});
        assert_eq!(differences(same, fresh.clone()), Vec::<String>::new());
        let edited =
            json!({"cost": {"final": 1.0 + 1e-6}, "list": [1.0, 2.0, 3.0], "status": "fixed"});
        let expected = ["/cost/final", "/list/1", "/list/2", "/status"];
        assert_eq!(differences(edited, fresh), expected);
    }
}
