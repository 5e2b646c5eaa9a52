//! Jumps of an input between two samples.

/// Smallest ratio of a jump to the changes before and after it, and to the largest one.
const ISOLATED: f64 = 5.0;
const LARGE: f64 = 0.1;
/// Smallest share of the squares of all changes, and largest number relative to that of the samples.
const SHARE: f64 = 0.5;
const FEW: f64 = 0.1;

/// The samples before which a series jumps, in order: few changes between neighbours that are alone and larger than all others together.
/// A pulse returns, and a steep slope has neighbours.
pub fn jumps(values: &[f64]) -> Vec<usize> {
    let changes: Vec<f64> = values
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let largest = changes.iter().fold(0.0f64, |most, d| most.max(*d));
    let at = |i: Option<usize>| i.and_then(|i| changes.get(i)).copied().unwrap_or(0.0);
    let is_jump = |i: &usize| {
        let beside = at(i.checked_sub(1)).max(at(Some(i + 1)));
        changes[*i] > (ISOLATED * beside).max(LARGE * largest)
    };
    let found: Vec<usize> = (0..changes.len()).filter(is_jump).collect();
    let square = |d: &f64| d * d;
    let all: f64 = changes.iter().map(square).sum();
    let of_jumps: f64 = found.iter().map(|i| square(&changes[*i])).sum();
    let is_few = (found.len() as f64) < FEW * values.len() as f64;
    match is_few && of_jumps > SHARE * all {
        true => found.into_iter().map(|i| i + 1).collect(),
        false => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_jump_and_pulses_and_slopes_do_not() {
        let noise = |i: usize| 1e-3 * (((i * i * 7919) % 1009) as f64 / 504.5 - 1.0);
        let series = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..400).map(|i| of(i as f64) + noise(i)).collect()
        };
        let step = |t: f64| if t < 100.0 { 0.0 } else { 1.0 };
        assert_eq!(jumps(&series(&step)), [100]);
        assert_eq!(jumps(&series(&|t| step(t) - step(t - 150.0))), [100, 250]);
        for (name, values) in [
            ("sine", series(&|t| (0.3 * t).sin())),
            ("ramp", series(&|t| (0.2 * (t - 100.0)).clamp(0.0, 1.0))),
            (
                "blow",
                series(&|t| (1.0 - (0.4 * (t - 100.0)).powi(2)).max(0.0)),
            ),
            ("spike", series(&|t| if t == 100.0 { 1.0 } else { 0.0 })),
            ("noise", series(&|_| 0.0)),
            ("square wave", series(&|t| (t / 4.0).floor() % 2.0)),
        ] {
            assert_eq!(jumps(&values), [0; 0], "{name}");
        }
    }
}
