//! Scales of the samples of a TDMS file: properties `NI_Scale[i]_…` of a channel, its group or the file.

use super::tdms_meta::{Properties, Property};

/// A scale: coefficients of a polynomial, and the scale before it; `None` for the samples as they are stored.
pub(super) struct Scale {
    coefficients: Vec<f64>,
    input: Option<usize>,
}

/// Most scales and coefficients.
const MOST: usize = 64;

fn number(properties: &Properties, name: &str) -> Option<f64> {
    match properties.get(name)? {
        Property::Number(number) => Some(*number),
        _ => None,
    }
}

fn kind(properties: &Properties, i: usize) -> Option<&str> {
    match properties.get(&format!("NI_Scale[{i}]_Scale_Type"))? {
        Property::Text(text) => Some(text),
        _ => None,
    }
}

/// Number of scales: as stated, else of those that have a type; none where the samples are scaled.
pub(super) fn count(properties: &Properties) -> usize {
    if properties.get("NI_Scaling_Status") == Some(&Property::Text("scaled".to_owned())) {
        return 0;
    }
    match number(properties, "NI_Number_Of_Scales") {
        Some(count) => (count as usize).min(MOST + 1),
        None => (0..MOST)
            .rfind(|i| kind(properties, *i).is_some())
            .map_or(0, |last| last + 1),
    }
}

/// The scales in their order.
///
/// # Errors
/// The content of a channel with another scale.
pub(super) fn of(properties: &Properties) -> Result<Vec<Scale>, String> {
    let count = count(properties);
    let scale = |i: usize| {
        let kind = kind(properties, i).unwrap_or("unknown");
        let of_scale = |name: &str| number(properties, &format!("NI_Scale[{i}]_{kind}_{name}"));
        let coefficients = match kind {
            "Linear" => {
                of_scale("Slope").map(|slope| vec![of_scale("Y_Intercept").unwrap_or(0.0), slope])
            }
            "Polynomial" => (0..of_scale("Coefficients_Size")
                .unwrap_or(4.0)
                .clamp(0.0, MOST as f64) as usize)
                .map(|j| of_scale(&format!("Coefficients[{j}]")))
                .collect(),
            _ => None,
        };
        let unknown = || {
            format!(
                "raw samples with {count} scales, number {} of type {kind}",
                i + 1
            )
        };
        let coefficients = coefficients
            .filter(|all| !all.is_empty())
            .ok_or_else(unknown)?;
        // Without a statement a scale follows the one before.
        let input = of_scale("Input_Source").map(|source| source as usize);
        let before = i.checked_sub(1);
        let input = input.map_or(before, |source| Some(source).filter(|source| *source < i));
        Ok(Scale {
            coefficients,
            input,
        })
    };
    match count > MOST {
        true => Err(format!("raw samples with more than {MOST} scales")),
        false => (0..count).map(scale).collect(),
    }
}

/// Replaces each sample by the value of the last scale.
pub(super) fn apply(scales: &[Scale], samples: &mut [f64]) {
    let mut chain = Vec::new();
    let mut next = scales.len().checked_sub(1);
    while let Some(scale) = next.and_then(|i| scales.get(i)) {
        chain.push(&scale.coefficients);
        next = scale.input;
    }
    for sample in samples {
        for coefficients in chain.iter().rev() {
            *sample = coefficients
                .iter()
                .rev()
                .fold(0.0, |sum, c| sum * *sample + c);
        }
    }
}
