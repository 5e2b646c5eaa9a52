//! Spelling of units: a table of named units, and the grammar of their products.

use super::{Powers, Symbol, Unit, VOLT, unbracketed};

/// Standard gravity, m/s² (ISO 80000-3).
pub(super) const GRAVITY: f64 = 9.806_65;

/// Degrees to radians.
pub(super) const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// International inch and foot, m; pound-force, N.
const INCH: f64 = 0.0254;
const FOOT: f64 = 0.3048;
const POUND_FORCE: f64 = 0.453_592_37 * GRAVITY;

/// A named unit that others are made of.
struct Base {
    /// Symbol, and further spellings.
    names: &'static str,
    /// Prefixes of the symbol.
    prefixes: &'static [&'static str],
    factor: f64,
    powers: Powers,
}

const fn base(
    names: &'static str,
    prefixes: &'static [&'static str],
    factor: f64,
    powers: Powers,
) -> Base {
    Base {
        names,
        prefixes,
        factor,
        powers,
    }
}

const SMALL: &[&str] = &["m", "µ", "n"];
const LENGTH: Powers = [1, 0, 0, 0, 0];
const TIME: Powers = [0, 1, 0, 0, 0];
const FORCE: Powers = [0, 0, 1, 0, 0];
const ANGLE: Powers = [0, 0, 0, 1, 0];
const VELOCITY: Powers = [1, -1, 0, 0, 0];
const ACCELERATION: Powers = [1, -2, 0, 0, 0];

/// All named units. Definitions: BIPM, SI brochure; NIST SP 811.
const BASES: [Base; 26] = [
    base(
        "m meter metre",
        &["m", "µ", "n", "c", "d", "k"],
        1.0,
        LENGTH,
    ),
    base("micron", &[], 1e-6, LENGTH),
    base("in inch inche", &[], INCH, LENGTH),
    base("mil thou", &[], 1e-3 * INCH, LENGTH),
    base("ft foot feet", &[], FOOT, LENGTH),
    base("yd yard", &[], 3.0 * FOOT, LENGTH),
    base("s sec second sek sekunde sekunden", SMALL, 1.0, TIME),
    base("min minute", &[], 60.0, TIME),
    base("h hr hour", &[], 3600.0, TIME),
    base("day", &[], 86400.0, TIME),
    base(
        "N newton",
        &["m", "µ", "n", "c", "d", "da", "h", "k", "M", "G"],
        1.0,
        FORCE,
    ),
    base("lbf lb pound", &["k"], POUND_FORCE, FORCE),
    base("kip", &[], 1e3 * POUND_FORCE, FORCE),
    base("ozf", &[], POUND_FORCE / 16.0, FORCE),
    base("kgf kp kilopond", &[], GRAVITY, FORCE),
    base("gf pond", &["m"], 1e-3 * GRAVITY, FORCE),
    base("tf", &[], 1e3 * GRAVITY, FORCE),
    base("dyn dyne", &["k", "M"], 1e-5, FORCE),
    base("rad radian", SMALL, 1.0, ANGLE),
    base("deg degree", &["m"], DEGREE, ANGLE),
    base("V volt", &["m", "µ", "n", "k"], 1.0, VOLT),
    base("mps", &["m", "c"], 1.0, VELOCITY),
    base("ips", &["m"], INCH, VELOCITY),
    base(
        "g G gn gee gs gravity gravitie gforce",
        SMALL,
        GRAVITY,
        ACCELERATION,
    ),
    base("%g", &[], 1e-2 * GRAVITY, ACCELERATION),
    base("gal galileo", &["m", "µ"], 1e-2, ACCELERATION),
];

/// All names of units.
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    BASES.iter().flat_map(|base| base.names.split(' '))
}

/// Prefixes with their names.
const PREFIXES: [(&str, &str, f64); 10] = [
    ("n", "nano", 1e-9),
    ("µ", "micro", 1e-6),
    ("m", "milli", 1e-3),
    ("c", "centi", 1e-2),
    ("d", "deci", 1e-1),
    ("da", "deca", 1e1),
    ("h", "hecto", 1e2),
    ("k", "kilo", 1e3),
    ("M", "mega", 1e6),
    ("G", "giga", 1e9),
];

/// Symbol, factor and powers of a name with its prefix. Words of more than two letters stand in any case and in the plural.
fn named(word: &str) -> Option<(String, f64, Powers)> {
    let word = match word.strip_prefix('u') {
        Some(rest) => format!("µ{rest}"),
        None => word.to_owned(),
    };
    let small = word.to_lowercase();
    let singular = small.strip_suffix('s').filter(|text| text.len() > 1);
    let is = |prefix: &str, name: &str| {
        let whole = format!("{prefix}{name}");
        let is_word = name.len() > 2 || prefix.len() > 2 || name.len() == 2 && prefix.is_empty();
        word == whole || is_word && (small == whole || singular == Some(&whole))
    };
    BASES.iter().find_map(|base| {
        let symbol = base.names.split(' ').next().unwrap_or_default();
        let none = ("", "", 1.0);
        let own = PREFIXES.iter().filter(|p| base.prefixes.contains(&p.0));
        let mut all = std::iter::once(&none).chain(own);
        let (short, _, factor) = all.find(|(short, long, _)| {
            let mut names = base.names.split(' ');
            names.any(|name| is(short, name) || is(long, name))
        })?;
        Some((
            format!("{short}{symbol}"),
            factor * base.factor,
            base.powers,
        ))
    })
}

/// The unit that a text names as a product: of any dimension.
pub(super) fn product(text: &str) -> Option<Unit> {
    // Reference times of netCDF: `seconds since 2024-01-10`.
    let text = unbracketed(text);
    let text = text.split(" since ").next().unwrap_or(text);
    if text.is_empty() || text.len() > 40 {
        return None;
    }
    let read = |text: &str| parse_product(&spelt(text));
    read(text).or_else(|| {
        // All capitals, as old programs write.
        let small = text.to_lowercase();
        let is_capital = text.chars().any(char::is_uppercase) && text.to_uppercase() == text;
        is_capital
            .then(|| read(&small.replace("kn", "kN")))
            .flatten()
    })
}

/// A unit with one spelling of powers, signs and words.
fn spelt(text: &str) -> String {
    let mut plain = text.replace("**", "^");
    for (from, to) in [
        (" per ", "/"),
        (" squared", "^2"),
        ("⁻²", "^-2"),
        ("⁻¹", "^-1"),
        ("²", "^2"),
        ("⁻", "-"),
        ("−", "-"),
        ("¹", "1"),
        ("μ", "µ"),
        ("°", "deg"),
        ("·", " "),
        ("⋅", " "),
        ("×", " "),
        ("*", " "),
        ("% g", "%g"),
        ("g-force", "g"),
        ("'s", ""),
        ("milli-", "m"),
        ("micro-", "µ"),
        ("kilo-", "k"),
    ] {
        plain = plain.replace(from, to);
    }
    // `ms-2` and `ms2` are m s^-2.
    for (end, power) in [
        ("s-1", -1),
        ("s^-1", -1),
        ("s-2", -2),
        ("s^-2", -2),
        ("s2", -2),
        ("s^2", -2),
        ("ps2", -2),
    ] {
        if let Some(rest) = plain.strip_suffix(end)
            && rest.ends_with(|c: char| c.is_alphabetic() && c != 'p')
            && !rest.contains('/')
        {
            plain = format!("{rest} s{power}");
        }
    }
    plain
}

/// Product of names with powers; a slash divides by the next factor, brackets hold a product.
fn parse_product(text: &str) -> Option<Unit> {
    let mut parts: Vec<(String, i8)> = Vec::new();
    let (mut factor, mut powers) = (1.0, [0i8; 5]);
    let mut signs = vec![1i8];
    let mut divides = false;
    let mut rest = text.trim();
    while let Some(first) = rest.chars().next() {
        let sign = signs.last().copied()? * if divides { -1 } else { 1 };
        match first {
            ' ' | '.' => rest = &rest[1..],
            '-' if !parts.is_empty() && !divides => rest = &rest[1..],
            '/' if !divides && !parts.is_empty() => {
                divides = true;
                rest = &rest[1..];
            }
            '(' => {
                signs.push(sign);
                divides = false;
                rest = &rest[1..];
            }
            ')' if signs.len() > 1 && !divides => {
                signs.pop();
                rest = &rest[1..];
            }
            _ => {
                let end = rest.find(|c: char| !(c.is_alphabetic() || "%µ".contains(c)));
                let (word, after) = rest.split_at(end.unwrap_or(rest.len()));
                let (power, after) = power(word, after)?;
                rest = after;
                for (symbol, own, of) in words(word)? {
                    let power = power * sign;
                    factor *= own.powi(i32::from(power));
                    for (sum, one) in powers.iter_mut().zip(of) {
                        *sum = sum.checked_add(one.checked_mul(power)?)?;
                    }
                    match parts.iter_mut().find(|(known, _)| *known == symbol) {
                        Some((_, sum)) => *sum = sum.checked_add(power)?,
                        None => parts.push((symbol, power)),
                    }
                }
                divides = false;
            }
        }
    }
    if divides || signs.len() > 1 || parts.is_empty() {
        return None;
    }
    let of_sign = |sign: i8| {
        let parts = parts
            .iter()
            .filter(move |(_, power)| power.signum() == sign);
        let parts = parts.map(|(symbol, power)| match power.abs() {
            1 => symbol.clone(),
            2 => format!("{symbol}²"),
            other => format!("{symbol}^{other}"),
        });
        parts.collect::<Vec<_>>()
    };
    let (above, below) = (of_sign(1).join(" "), of_sign(-1));
    let below = below.iter().map(|symbol| format!("/{symbol}"));
    Some(Unit {
        symbol: Symbol::of(&below.fold(above, |text, part| text + &part))?,
        factor,
        powers,
    })
}

/// The power behind a name, and the text after it.
fn power<'a>(word: &str, text: &'a str) -> Option<(i8, &'a str)> {
    let digits = text.strip_prefix('^').map(|t| t.trim_start_matches('('));
    let number = digits.unwrap_or(text);
    let (sign, number) = match number.strip_prefix('-') {
        Some(number) if number.starts_with(|c: char| c.is_ascii_digit()) => (-1, number),
        _ => (1, number),
    };
    let end = number
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(number.len());
    let (value, after) = number.split_at(end);
    match value {
        // `g0` is the standard gravity.
        "0" if word == "g" => Some((1, after)),
        "" => digits.is_none().then_some((1, text)),
        value => {
            let after = match text.starts_with("^(") {
                true => after.strip_prefix(')')?,
                false => after,
            };
            let value: i8 = value.parse().ok().filter(|n| (1..=3).contains(n))?;
            Some((sign * value, after))
        }
    }
}

/// The units of a word: one, or a force and a length that touch, as in `Nm`.
fn words(word: &str) -> Option<Vec<(String, f64, Powers)>> {
    if let Some(one) = named(word) {
        return Some(vec![one]);
    }
    let splits = word.char_indices().skip(1).map(|(at, _)| word.split_at(at));
    let torque = |(a, b): (&str, &str)| {
        let (a, b) = (named(a)?, named(b)?);
        let mut both = [a.2, b.2];
        both.sort_unstable();
        (both == [FORCE, LENGTH]).then(|| vec![a, b])
    };
    splits.into_iter().find_map(torque)
}
