//! Quantities and parts of a system by the names of columns: the one table of names.

use crate::units::Measurand;

/// Beginnings of words, and whole words that stand first in a name, in lower case, by quantity. The former take precedence.
const NAMES: [(Measurand, &str, &str); 5] = [
    (
        Measurand::Time,
        "time zeit uhrzeit millis micros elapsed",
        "t date datum datenum matlab epoch jd mjd julian",
    ),
    (Measurand::Acceleration, "acc beschl", "a ax ay az"),
    (
        Measurand::Velocity,
        "vel gyr omega geschw speed",
        "v vx vy vz \u{3c9}",
    ),
    (
        Measurand::Displacement,
        "disp pos defl angle winkel ausl elong stroke theta phi lvdt",
        "roll pitch yaw weg y x z u s",
    ),
    (
        Measurand::Force,
        "force load torque kraft hammer",
        "f fx fy fz",
    ),
];
/// Words in a name that denote the base.
const BASE: [&str; 4] = ["base", "table", "ground", "support"];
/// Words that denote a signal that drives the system, unless the name has one of a quantity or its unit.
const DRIVE: [&str; 7] = [
    "drive",
    "motor",
    "command",
    "cmd",
    "excitation",
    "setpoint",
    "voltage",
];
/// Words that stand for quantities without a role where they end a name, in lower case.
const FOREIGN: [&str; 21] = [
    "hz", "khz", "rpm", "degc", "°c", "degf", "°f", "celsius", "kelvin", "%", "percent", "pa",
    "kpa", "mpa", "psi", "bar", "ohm", "ma", "db", "kg", "strain",
];

/// The words of a name in lower case: parted by signs, digits and capitals.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before = ' ';
    for c in name.chars() {
        if !c.is_alphabetic() || c.is_uppercase() && before.is_lowercase() {
            words.push(String::new());
        }
        if let (Some(last), true) = (words.last_mut(), c.is_alphabetic()) {
            last.extend(c.to_lowercase());
        }
        before = c;
    }
    words.retain(|word| !word.is_empty());
    words
}

fn begun(words: &[String]) -> Option<Measurand> {
    words.iter().find_map(|word| {
        let mut all = NAMES.iter();
        let found =
            all.find(|(_, begins, _)| begins.split(' ').any(|begin| word.starts_with(begin)));
        found.map(|(quantity, ..)| *quantity)
    })
}

/// The quantity that a name states.
///
/// ```
/// # use kmcfit::quantity_names::quantity_of;
/// use kmcfit::units::Measurand;
/// assert_eq!(quantity_of("linear_acceleration.z"), Some(Measurand::Acceleration));
/// assert_eq!(quantity_of("gyro_z"), Some(Measurand::Velocity));
/// assert_eq!(quantity_of("ch 1"), None);
/// ```
pub fn quantity_of(name: &str) -> Option<Measurand> {
    let words = words(name);
    // The times of a force.
    if let [first, _, ..] = words.as_slice()
        && first == "t"
    {
        return Some(Measurand::Time);
    }
    begun(&words).or_else(|| {
        let first = words.first()?;
        let mut all = NAMES.iter();
        let found = all.find(|(_, _, whole)| whole.split(' ').any(|whole| whole == first));
        found.map(|(quantity, ..)| *quantity)
    })
}

/// True for the name of a quantity without a role: by its last word, a unit such as `rpm`, unless it names a force, displacement or
/// acceleration; and for a signal that drives the system.
pub fn is_foreign(name: &str) -> bool {
    let quantity = begun(&words(name));
    let small = name.to_lowercase();
    let mut parts = small.split(['_', ' ', '[', ']', '(', ')', '/']);
    parts.next();
    let last = parts.rfind(|part| !part.is_empty());
    let has_unit = last.is_some_and(|unit| FOREIGN.contains(&unit));
    let is_velocity = quantity == Some(Measurand::Velocity);
    has_unit && (quantity.is_none() || is_velocity) || is_drive(name)
}

/// True for the name of a signal that drives the system.
pub fn is_drive(name: &str) -> bool {
    let words = words(name);
    let is = |word: &String| DRIVE.contains(&word.as_str());
    begun(&words).is_none() && words.iter().any(is)
}

/// A label without a word for the base, and true if it had one: `table_acc` is an acceleration of the base.
pub fn without_base(label: &str) -> (String, bool) {
    // ASCII lower case keeps the byte length.
    let small = label.to_ascii_lowercase();
    let found = BASE
        .iter()
        .find_map(|word| Some((small.find(word)?, word.len())));
    let Some((at, length)) = found else {
        return (label.to_owned(), false);
    };
    let rest = [&label[..at], &label[at + length..]].concat();
    let is_separator = |c: char| matches!(c, '_' | ' ' | '-' | '.');
    (rest.trim_start_matches(is_separator).to_owned(), true)
}
