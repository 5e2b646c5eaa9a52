//! Times of channels that have clocks of their own: aligned where they are equally spaced with one step, and named elsewhere.

use std::cmp::Reverse;
use std::collections::BTreeSet;

use super::names::{factor_of_time, letters};
use super::{FileChannel, Sampling, last_part};
use crate::quantity_names::quantity_of;
use crate::units::Measurand;
use kmcfit_core::number_format::significant;

/// Deviation from whole steps by the rounding of times.
const ALIGNED: f64 = 1e-5;
/// Deviation from equal spacing, in steps, of times that are those of a rate.
const EVEN: f64 = 0.01;

fn is_time(channel: &FileChannel) -> bool {
    channel.values.windows(2).all(|pair| pair[1] > pair[0])
        && quantity_of(last_part(&channel.name)) == Some(Measurand::Time)
}

/// First time and step of equally spaced times in this unit.
pub(super) fn sampling_of(times: &[f64], unit: &str) -> Option<Sampling> {
    let (&[first, .., last], factor) = (times, factor_of_time(unit)?) else {
        return None;
    };
    let step = (last - first) / (times.len() - 1) as f64;
    let is_even = |(i, t): (usize, &f64)| (t - first - i as f64 * step).abs() <= EVEN * step;
    let is_rate = times.iter().enumerate().all(is_even);
    is_rate
        .then(|| Sampling::interval(factor * first, factor * step))
        .flatten()
}

/// Lengths of the channels whose times are another channel.
pub(super) fn timed(channels: &[FileChannel]) -> BTreeSet<usize> {
    let timers = channels.iter().filter(|c| c.values.len() > 1 && is_time(c));
    timers.map(|c| c.values.len()).collect()
}

/// The times of a channel among others of its length: with its name in theirs, else in the nearest group.
fn timer_of(own: &FileChannel, channels: &[FileChannel], timers: &[usize]) -> Option<usize> {
    let name = letters(last_part(&own.name));
    let nearness = |timer: &&usize| {
        let times = &channels[**timer].name;
        let is_named = letters(last_part(times)).ends_with(&name);
        let groups = times.match_indices('.').map(|(at, _)| at + 1);
        let shared = groups
            .filter(|end| times.get(..*end) == own.name.get(..*end))
            .max();
        // The shorter name is that of all channels.
        (is_named, shared, Reverse(last_part(times).len()))
    };
    let fitting = timers
        .iter()
        .filter(|timer| channels[**timer].values.len() == own.values.len());
    // The first of equals.
    fitting.rev().max_by_key(nearness).copied()
}

/// Gives channels the rate of their own times, `t_acc` or `time` in their group, where those of channels of other quantities differ. Returns
/// the number of these channels.
pub(crate) fn own_times(channels: &mut [FileChannel]) -> usize {
    let is_timer = |i: &usize| {
        let own = &channels[*i];
        own.values.len() > 2 && own.sampling.is_none() && is_time(own)
    };
    let (timers, others): (Vec<usize>, Vec<usize>) = (0..channels.len()).partition(is_timer);
    if timers.len() < 2 {
        return 0;
    }
    let sampling = |timer: usize| {
        let times = &channels[timer];
        let end = last_part(&times.name)
            .rsplit_once('_')
            .map(|(_, unit)| unit);
        let end = end.filter(|unit| factor_of_time(unit).is_some());
        sampling_of(&times.values, times.unit.as_deref().or(end).unwrap_or("s"))
    };
    let owner = |i: usize| {
        let own = Some(&channels[i]).filter(|own| own.values.len() > 1)?;
        let timer = timer_of(own, channels, &timers)?;
        let kind = quantity_of(last_part(&own.name)).or_else(|| quantity_of(&own.name));
        Some((i, timer, kind))
    };
    let owners: Vec<_> = others.into_iter().filter_map(owner).collect();
    let differ = |a: usize, b: usize| {
        let [one, other] = [a, b].map(|i| &channels[i].values);
        let is_shifted = |(a, b): (Sampling, Sampling)| {
            (a.step() / b.step() - 1.0).abs() < 1e-9 && a.time(0) != b.time(0)
        };
        match one.len() == other.len() {
            true => one != other,
            false => sampling(a).zip(sampling(b)).is_some_and(is_shifted),
        }
    };
    // Runs have the same quantities.
    let is_run = |a: &(usize, usize, _), b: &(usize, usize, _)| a.1 != b.1 && a.2 == b.2;
    let are_runs = owners.iter().any(|a| owners.iter().any(|b| is_run(a, b)));
    let used: BTreeSet<usize> = owners.iter().map(|owner| owner.1).collect();
    let first = used.first().copied().unwrap_or(0);
    if are_runs || !used.iter().any(|timer| differ(first, *timer)) {
        return 0;
    }
    let found: Vec<_> = (owners.iter())
        .map(|(i, timer, _)| (*i, *timer, sampling(*timer)))
        .collect();
    for (i, timer, sampling) in &found {
        let statement = format!("times of its own in `{}`", channels[*timer].name);
        channels[*i].sampling = *sampling;
        let is_uneven = sampling.is_none();
        channels[*i]
            .unapplied
            .extend(is_uneven.then_some(statement));
    }
    found
        .iter()
        .filter(|(.., sampling)| sampling.is_some())
        .count()
}

/// Takes the difference of the first times of channels into account; where the times stand in the file, it is named.
pub(super) fn begin_at(
    channels: &mut [FileChannel],
    begins: &[Option<(f64, String)>],
    timed: &BTreeSet<usize>,
) {
    let all = || begins.iter().flatten().map(|(begin, _)| *begin);
    let (first, last) = (
        all().fold(f64::INFINITY, f64::min),
        all().fold(f64::NEG_INFINITY, f64::max),
    );
    for (channel, begin) in channels.iter_mut().zip(begins) {
        let Some((begin, text)) = begin else { continue };
        match channel
            .sampling
            .filter(|_| !timed.contains(&channel.values.len()))
        {
            Some(sampling) => channel.sampling = Some(sampling.later(begin - first)),
            None if last > first => channel.unapplied.push(text.clone()),
            None => {}
        }
    }
}

/// Common part of channels with the same step: they are cut to it, and each keeps the rest of a step by which it is later. Returns a note.
pub(crate) fn align(channels: &mut [FileChannel]) -> Option<String> {
    let axis = |channel: &FileChannel| match channel.sampling {
        Some(Sampling::Interval { start, step }) => Some((start, step, channel.values.len())),
        _ => None,
    };
    let axes: Vec<(f64, f64, usize)> = channels.iter().filter_map(axis).collect();
    let (first, step, _) = *axes.first()?;
    let from = axes.iter().fold(first, |most, axis| most.max(axis.0));
    let lag = |start: f64| ((from - start) / step).round();
    let has_step = |axis: &(f64, f64, usize)| (axis.1 / step - 1.0).abs() < 1e-9 && axis.2 > 1;
    let left = |axis: &(f64, f64, usize)| axis.2 as f64 - lag(axis.0);
    let count = axes.iter().map(left).fold(f64::INFINITY, f64::min);
    let shortest = axes.iter().map(|axis| axis.2).min()? as f64;
    if axes.iter().all(|axis| axis.0 == first)
        || !axes.iter().all(has_step)
        || count < 0.5 * shortest
    {
        return None;
    }
    let mut are_late = false;
    for channel in channels.iter_mut() {
        let Some((start, ..)) = axis(channel) else {
            continue;
        };
        let late = start + lag(start) * step - from;
        if late.abs() > ALIGNED * step {
            channel.late = late;
            are_late = true;
        }
        channel.values.drain(..lag(start) as usize);
        channel.values.truncate(count as usize);
        channel.sampling = Sampling::interval(from, step);
    }
    let span = axes
        .iter()
        .fold(0.0f64, |most, axis| most.max(from - axis.0));
    Some(format!(
        "the channels start up to {} s apart: the {count} samples at common times are used{}",
        significant(span, 4),
        if are_late {
            ", to a fraction of a step that each channel keeps"
        } else {
            ""
        }
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(name: &str, start: Option<f64>, values: &[f64]) -> FileChannel {
        FileChannel {
            name: name.to_owned(),
            sampling: start.and_then(|start| Sampling::interval(start, 0.5)),
            values: values.to_vec(),
            ..FileChannel::default()
        }
    }

    #[test]
    fn channels_are_cut_to_common_times() {
        let mut all = [
            channel("a", Some(1.0), &[1.0, 2.0, 3.0, 4.0]),
            channel("b", Some(2.0), &[5.0, 6.0, 7.0]),
        ];
        assert!(align(&mut all).is_some());
        assert_eq!(
            (&*all[0].values, &*all[1].values),
            (&[3.0, 4.0][..], &[5.0, 6.0][..])
        );
        assert_eq!(all[0].sampling, Sampling::interval(2.0, 0.5));
        // Records one after the other, and a fraction of a step.
        all[1].sampling = Sampling::interval(9.0, 0.5);
        assert_eq!(align(&mut all), None);
        all[1].sampling = Sampling::interval(2.2, 0.5);
        assert!(align(&mut all).is_some());
        assert!((all[0].late + 0.2).abs() < 1e-12 && all[1].late == 0.0);
    }

    #[test]
    fn channels_have_the_times_beside_them() {
        let times = |from: f64| [0.0, 0.5, 1.0, 1.5].map(|t| from + t);
        let mut all = [
            channel("t_force", None, &times(0.0)),
            channel("force", None, &[1.0; 4]),
            channel("t_acc", None, &times(0.5)),
            channel("acc", None, &[2.0; 4]),
        ];
        assert_eq!(own_times(&mut all), 2);
        assert_eq!(all[3].sampling, Sampling::interval(0.5, 0.5));
        // Runs keep theirs.
        for (i, name) in ["a.time", "a.acc", "b.time", "b.acc"].iter().enumerate() {
            all[i].name = (*name).to_owned();
            all[i].sampling = None;
        }
        assert_eq!(own_times(&mut all), 0);
    }
}
