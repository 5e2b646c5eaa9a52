//! Times of day and dates in fields of text, as seconds since the first of a column.

use crate::units::{Measurand, Unit};

/// A time of day, with its date where it is stated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Clock {
    /// Days since 1970-01-01.
    day: Option<i64>,
    /// Seconds of the day.
    seconds: f64,
    /// Of a date with slashes: the part that is read first.
    pub order: Option<&'static str>,
}

/// Seconds of a day.
pub(crate) const DAY: f64 = 86_400.0;
const MONTHS: [&str; 12] = [
    "jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec",
];

impl Clock {
    /// Reads `23:59:58.5`, `11:59:58,5 PM`, `59:58.5`, and one of these after a date `2024-01-10`, `2024/01/10`, `10.01.2024`,
    /// `10-Jan-2024` or `01/10/2024` or after `2 days`, parted by a blank or `T`; a time zone behind it counts. Reads
    /// `0.5 sec` as well.
    pub fn read(text: &str, day_first: bool) -> Option<Self> {
        let text = text.trim_matches(['"', '\'', ' ']);
        if let Some((number, unit)) = text.split_once(' ')
            && let (Ok(number), Some(unit)) = (
                number.parse::<f64>(),
                Unit::recognise(Measurand::Time, unit),
            )
        {
            return Some(Self {
                day: None,
                seconds: number * unit.factor(),
                order: None,
            });
        }
        let colon = text.find(':').filter(|_| text.len() < 50)?;
        let before = text[..colon]
            .char_indices()
            .rev()
            .find(|(_, c)| !c.is_ascii_digit());
        let (date, time) = text.split_at(before.map_or(0, |(at, c)| at + c.len_utf8()));
        if date.ends_with('-') || !date.is_ascii() {
            return None;
        }
        let end = time.find(|c: char| !(c.is_ascii_digit() || ":.,".contains(c)));
        let (time, zone) = time.split_at(end.unwrap_or(time.len()));
        let zone = zone.trim();
        let (afternoon, offset) = match zone.to_ascii_lowercase().as_str() {
            "am" => (Some(0.0), 0.0),
            "pm" => (Some(0.5 * DAY), 0.0),
            "" | "z" | "utc" | "gmt" => (None, 0.0),
            other => (None, offset(other)?),
        };
        let date = date.trim_end_matches(['T', ' ', '_', ',', '+']);
        // Durations of pandas.
        let days = date.strip_suffix("days").or(date.strip_suffix("day"));
        let (day, order) = match (date, days) {
            ("", _) => (None, None),
            (_, Some(days)) => (Some(days.trim().parse().ok()?), None),
            _ => {
                let (day, order) = day_of(date, day_first)?;
                (Some(day), order)
            }
        };
        let parts: Vec<f64> = (time.replace(',', ".").split(':'))
            .map(|part| part.parse().ok().filter(|_| !part.is_empty()))
            .collect::<Option<_>>()?;
        let has_fraction = time.contains(['.', ',']);
        let seconds = match *parts {
            [hours, minutes, seconds, millis] if !has_fraction => {
                3600.0 * hours + 60.0 * minutes + seconds + 1e-3 * millis
            }
            [hours, minutes, seconds] => 3600.0 * hours + 60.0 * minutes + seconds,
            [minutes, seconds] if has_fraction && day.is_none() => 60.0 * minutes + seconds,
            [hours, minutes] => 3600.0 * hours + 60.0 * minutes,
            _ => return None,
        };
        let twelve = afternoon.is_some() && seconds >= 0.5 * DAY;
        let seconds = seconds + afternoon.unwrap_or(0.0) - if twelve { 0.5 * DAY } else { 0.0 };
        // A zone without a date changes nothing but the same seconds of all rows.
        let seconds = seconds - if day.is_some() { offset } else { 0.0 };
        Some(Self {
            day,
            seconds,
            order,
        })
    }

    /// Seconds since the first time of a column.
    pub fn since(&self, first: &Self) -> f64 {
        let days = self.day.unwrap_or(0) - first.day.unwrap_or(0);
        DAY * days as f64 + (self.seconds - first.seconds)
    }

    /// Seconds since 1970, or of the day.
    pub fn absolute(&self) -> f64 {
        DAY * self.day.unwrap_or(0) as f64 + self.seconds
    }

    /// Adds a day after each midnight to times without dates, and half a day where a clock of twelve hours begins again.
    pub fn over_midnights(&self, times: &mut [f64]) {
        let (mut days, mut before) = (0.0, f64::NEG_INFINITY);
        for time in times.iter_mut().filter(|_| self.day.is_none()) {
            if *time < before - 0.75 * DAY {
                days += DAY;
            } else if *time < before - 0.49 * DAY {
                days += 0.5 * DAY;
            }
            before = *time;
            *time += days;
        }
    }
}

/// Seconds east of Greenwich: `+01:00`, `-0530`, `+2`.
fn offset(zone: &str) -> Option<f64> {
    let sign = if zone.starts_with('-') { -1.0 } else { 1.0 };
    let digits = zone.strip_prefix(['+', '-'])?.replace(':', "");
    let number: f64 = Some(&digits)
        .filter(|d| d.bytes().all(|b| b.is_ascii_digit()))?
        .parse()
        .ok()?;
    let (hours, minutes) = match digits.len() {
        1 | 2 => (number, 0.0),
        _ => ((number / 100.0).floor(), number % 100.0),
    };
    Some(sign * (3600.0 * hours + 60.0 * minutes))
}

/// Days since 1970-01-01 of a date, and the order of one with slashes: year first, else day first with points and lines, day or month first
/// with slashes.
fn day_of(date: &str, day_first: bool) -> Option<(i64, Option<&'static str>)> {
    let sign = ['-', '/', '.']
        .into_iter()
        .find(|sign| date.contains(*sign))?;
    let part = |part: &str| {
        let month = || MONTHS.iter().position(|m| part.eq_ignore_ascii_case(m));
        part.parse().ok().or_else(|| Some(month()? as i64 + 1))
    };
    let parts: Option<Vec<i64>> = date.split(sign).map(part).collect();
    let [a, b, c] = *parts? else { return None };
    let (year, month, day, order) = match (a > 31, sign) {
        (true, _) => (a, b, c, None),
        (false, '/') if !day_first => (c, a, b, Some("month")),
        (false, '/') => (c, b, a, Some("day")),
        (false, _) => (c, b, a, None),
    };
    let is_date =
        (0..10_000).contains(&year) && (1..=12).contains(&month) && (1..=31).contains(&day);
    is_date.then_some(())?;
    let year = if year < 100 { year + 2000 } else { year };
    // Years begin in March: a leap day is the last one.
    let (y, m) = if month > 2 {
        (year, month - 3)
    } else {
        (year - 1, month + 9)
    };
    let leap = y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400);
    Some((365 * y + leap + (153 * m + 2) / 5 + day - 719_469, order))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(text: &str) -> Option<f64> {
        let clock = Clock::read(text, false)?;
        Some(DAY * clock.day.unwrap_or(0) as f64 + clock.seconds)
    }

    #[test]
    fn times_of_day_and_dates() {
        let of = |day: i64, seconds: f64| Some(DAY * day as f64 + seconds);
        for (text, expected) in [
            ("23:59:58.5", of(0, 86398.5)),
            ("9:30", of(0, 34200.0)),
            ("59:58.5", of(0, 3598.5)),
            ("12:00:01,25", of(0, 43201.25)),
            ("12:00:01:250", of(0, 43201.25)),
            ("12:00:01 AM", of(0, 1.0)),
            ("1:00:00 pm", of(0, 46800.0)),
            ("1970-01-02T00:00:01Z", of(1, 1.0)),
            ("2024-03-01 01:00:00.5+01:00", of(19783, 0.5)),
            ("01.03.2024 00:00:00,5", of(19783, 0.5)),
            ("3/1/2024 00:00:00", of(19783, 0.0)),
            ("2024/02/29 12:00", of(19782, 43200.0)),
            ("01-Mar-2024 00:00:00.5", of(19783, 0.5)),
            ("2 days 00:00:00.002", of(2, 0.002)),
            ("-1 days +23:59:59.5", of(-1, 86399.5)),
            ("0.5 sec", of(0, 0.5)),
        ] {
            assert_eq!(seconds(text), expected, "{text}");
        }
        for text in [
            "12.5",
            "²1:30",
            "2024-01-10",
            "a:b",
            "",
            ":",
            "1:",
            "1:2:3:4:5",
            "-1:30",
            "x 1:30",
            "2024-13-01 1:00",
            "1:30 km",
            "t:1",
        ] {
            assert_eq!(seconds(text), None, "{text}");
        }
    }

    #[test]
    fn midnights_add_days() {
        let mut times = [0.0, 1.0, -86398.0, -86397.0];
        Clock::read("23:59:59", false)
            .expect("a time")
            .over_midnights(&mut times);
        assert_eq!(times, [0.0, 1.0, 2.0, 3.0]);
    }
}
