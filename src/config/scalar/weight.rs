//! Weights of penalties.

use super::written::number_in;
use super::{Number, Scalar, choose};
use crate::config::complaint::Complaint;
use crate::config::key::{Kind, Value};
use serde::de::{Deserialize, Deserializer, EnumAccess, Error, MapAccess, SeqAccess, Visitor};
use std::fmt;

choice! {
    /// How the weight of a penalty follows from the data.
    pub enum WeightRule {
        /// The largest weight that still fits the readings within their noise.
        Discrepancy = "discrepancy",
        /// The corner of misfit against roughness.
        LCurve = "l-curve",
        /// Generalised cross-validation.
        Gcv = "gcv",
        /// So that the function follows the readings within a dominant period of the motion.
        Period = "period",
    }
}

/// The weight of a penalty: a number, or the name of a rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Weight {
    /// Given.
    Number(Number),
    /// Chosen from the data.
    Rule(WeightRule),
}

impl Weight {
    fn read(scalar: Scalar<'_>) -> Result<Self, Complaint> {
        let names = || WeightRule::ALL.iter().map(|(name, _)| *name);
        let expected = format!("a finite number, or {}", crate::input::one_of(names()));
        let weight = match scalar {
            Scalar::Text(word) if number_in(word).is_none() => {
                choose(scalar, WeightRule::ALL).map(Self::Rule)
            }
            other => Number::read(other).map(Self::Number),
        };
        weight.map_err(|complaint| Complaint {
            expected,
            ..complaint
        })
    }
}

deserialize_scalar!(Weight, Weight::read, "a number or the name of a rule");

impl Value for Weight {
    const KIND: Kind = Kind::AnyOf(&[Kind::Number, WeightRule::KIND]);
}
