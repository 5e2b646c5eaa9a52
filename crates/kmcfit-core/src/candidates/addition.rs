//! What may be added to a model, and the problem with it.

use super::jump_basis;
use super::second_mode::Mode;
use crate::alternatives::{RecordParameter, extended, finer_basis, with_functions};
use crate::functions::{
    Basis, CoefficientFunction, CoefficientKind, Parameterization, ScalarParameter, ScalarValue,
};
use crate::problem::Problem;
use crate::record::Sensor;
use crate::structure::Law;

/// One thing that may be added to a model. Functions, experiments and channels are named by their indices.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Addition {
    /// A force with a constant coefficient.
    Term(CoefficientKind, Law),
    /// A function that varies slowly: a polynomial in place of a constant.
    Variation {
        /// Index of the function.
        function: usize,
        /// Degree of the polynomial.
        degree: usize,
        /// Degree of the polynomial that a model with it [has](super::Candidate::added_to).
        next: usize,
    },
    /// A function with a multiple of its intervals between knots, or a polynomial of a higher degree.
    FinerBasis {
        /// Index of the function.
        function: usize,
        /// Number of times that the intervals are halved.
        halvings: usize,
    },
    /// A constant that jumps.
    Jump {
        /// Index of the function.
        function: usize,
        /// Time of the jump, s.
        time: f64,
    },
    /// A parameter of a record.
    Record(RecordParameter),
    /// Errors of the measured input of an experiment, or an unmeasured force.
    Disturbance {
        /// Index of the experiment.
        experiment: usize,
    },
    /// Errors of few samples of the measured force of the only record.
    InputPulses {
        /// Number of the samples.
        count: usize,
        /// Time of the largest error, s.
        time: f64,
        /// Recorded less true force there, N.
        error: f64,
    },
    /// Cubic splines in place of lines between the samples of the inputs.
    CubicInputs,
    /// A sensor whose samples have parts of the square and the cube of the response.
    SensorCurve {
        /// Index of the experiment.
        experiment: usize,
        /// Index of its channel.
        channel: usize,
    },
    /// A sine of this frequency in the samples of a channel.
    Tone {
        /// Index of the experiment.
        experiment: usize,
        /// Index of its channel.
        channel: usize,
        /// Frequency, Hz.
        frequency: f64,
    },
    /// The response of a second mode in the samples of a channel.
    SecondMode {
        /// Index of the experiment.
        experiment: usize,
        /// Index of its channel.
        channel: usize,
        /// Natural frequency (Hz) and damping ratio.
        mode: Mode,
    },
}

/// Candidates that a record may not tell apart: where one of them is good, the others are refitted as well.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Family {
    /// The restoring force or the inertia changes with time or amplitude.
    Elastic,
    /// The damping changes with time or amplitude.
    Dissipative,
    /// The sensor has an offset or a drift.
    Level,
    /// The samples have a further frequency.
    Frequency,
    /// Input and response are not simultaneous, or the input is not as interpolated.
    Timing,
    /// A channel has another factor.
    Factor,
    /// Noise that enters through the equation of motion.
    Noise,
}

impl Addition {
    /// True for one candidate with other values of what was searched.
    pub(super) fn is_like(self, other: Self) -> bool {
        match (self, other) {
            (Self::Variation { function: f, .. }, Self::Variation { function: g, .. })
            | (
                Addition::FinerBasis { function: f, .. },
                Addition::FinerBasis { function: g, .. },
            )
            | (Self::Jump { function: f, .. }, Addition::Jump { function: g, .. }) => f == g,
            (
                Addition::SecondMode {
                    experiment: e,
                    channel: c,
                    ..
                },
                Addition::SecondMode {
                    experiment: f,
                    channel: d,
                    ..
                },
            ) => (e, c) == (f, d),
            (Self::InputPulses { .. }, Self::InputPulses { .. }) => true,
            _ => self == other,
        }
    }

    /// True for a function that varies more.
    pub(super) fn varies(self) -> bool {
        matches!(self, Self::Variation { .. } | Self::FinerBasis { .. })
    }

    pub(super) fn family(self, problem: &Problem) -> Family {
        let of_kind = |kind: CoefficientKind| match kind {
            CoefficientKind::DAMPING
            | CoefficientKind::QUADRATIC_DAMPING
            | CoefficientKind::COULOMB_FRICTION => Family::Dissipative,
            _ => Family::Elastic,
        };
        match self {
            Self::Term(kind, _) => of_kind(kind),
            Self::Variation { function, .. }
            | Self::FinerBasis { function, .. }
            | Self::Jump { function, .. } => of_kind(problem.functions.get(function).quantity),
            Self::Record(RecordParameter::Offset(..) | RecordParameter::Drift(..)) => Family::Level,
            Self::Record(RecordParameter::Delay(_) | RecordParameter::Rate(_))
            | Self::CubicInputs => Family::Timing,
            Self::Record(RecordParameter::Gain(..)) => Family::Factor,
            Self::Disturbance { .. } | Self::InputPulses { .. } => Family::Noise,
            Self::SensorCurve { .. } | Self::Tone { .. } | Self::SecondMode { .. } => {
                Family::Frequency
            }
        }
    }

    /// The problem with the addition, and the start of its fit at the parameters `theta` of the problem and `further` ones; `None` for what is
    /// added to predictions, and where the problem cannot have it.
    pub(super) fn added(
        self,
        problem: &Problem,
        theta: &[f64],
        further: &[f64],
    ) -> Option<(Problem, Vec<f64>)> {
        match self {
            Self::Term(kind, law) => {
                let function = CoefficientFunction::constant(kind, 0.0, problem.functions.nodes());
                let further_terms = vec![(function, law)];
                let (changed, mut start) = extended(problem, theta, further_terms)?;
                start[problem.functions.scalar_range().start] = *further.first()?;
                Some((changed, start))
            }
            Self::Variation {
                function, degree, ..
            } => {
                let basis = Basis::Polynomial { degree };
                let own = &theta[problem.functions.ranges()[function].clone()];
                let mut start = own.to_vec();
                start.extend(further);
                start.resize(degree + 1, 0.0);
                in_basis(problem, theta, function, basis, start)
            }
            Self::FinerBasis { function, halvings } => {
                let own = problem.functions.get(function);
                let grid = &problem.system.grid;
                let finer = |basis: Option<Basis>, _| finer_basis(problem, &basis?);
                let finer = (0..halvings).fold(own.basis.clone(), finer)?;
                let range = problem.functions.ranges()[function].clone();
                let values = own.design.multiply(&theta[range], grid.nodes());
                let start = finer.project(grid, &values)?;
                in_basis(problem, theta, function, finer, start)
            }
            Self::Jump { function, time } => {
                let before = theta[problem.functions.ranges()[function].start];
                let after = before + further.first()?;
                let start = vec![before, 0.5 * (before + after), after];
                in_basis(
                    problem,
                    theta,
                    function,
                    jump_basis::basis(&problem.system.grid, time)?,
                    start,
                )
            }
            Self::Record(RecordParameter::Rate(_)) => None,
            Self::Record(parameter) => with_record(problem, theta, parameter, *further.first()?),
            Self::CubicInputs
            | Self::InputPulses { .. }
            | Self::Disturbance { .. }
            | Self::SensorCurve { .. }
            | Self::Tone { .. }
            | Self::SecondMode { .. } => None,
        }
    }
}

/// The problem with a function in another basis, and the start with these parameters of it.
fn in_basis(
    problem: &Problem,
    theta: &[f64],
    function: usize,
    basis: Basis,
    of_function: Vec<f64>,
) -> Option<(Problem, Vec<f64>)> {
    let functions = &problem.functions;
    let grid = &problem.system.grid;
    (basis.parameters(grid) == of_function.len()).then_some(())?;
    let range = functions.ranges()[function].clone();
    let start = [&theta[..range.start], &of_function, &theta[range.end..]].concat();
    let mut list: Vec<CoefficientFunction> = functions.iter().cloned().collect();
    let own = &list[function];
    list[function] = CoefficientFunction {
        owner: own.owner.clone(),
        is_known_part: own.is_known_part,
        offset: own.offset.clone(),
        ..CoefficientFunction::free(own.quantity, basis, grid, of_function)
    };
    let sets = functions.coefficient_sets().to_vec();
    let changed = Parameterization::with_coefficient_sets(list, sets, grid.nodes(), grid.step())?
        .with_scalars(functions.scalars().to_vec());
    Some((with_functions(problem, changed, Vec::new())?, start))
}

/// The problem with a parameter of a record as its last scalar.
fn with_record(
    problem: &Problem,
    theta: &[f64],
    parameter: RecordParameter,
    value: f64,
) -> Option<(Problem, Vec<f64>)> {
    let mut scalars = problem.functions.scalars().to_vec();
    let estimated = ScalarValue::Estimated(scalars.len());
    let start = match parameter {
        RecordParameter::Gain(..) => 1.0 + value,
        _ => value,
    };
    scalars.push(ScalarParameter {
        name: "added".to_owned(),
        unit: String::new(),
        start,
        size: start.abs(),
        prior: None,
    });
    let changed = problem.clone().with(|parts| {
        parts.functions = parts.functions.clone().with_scalars(scalars);
        for (e, experiment) in parts.experiments.iter_mut().enumerate() {
            for (c, channel) in experiment.channels.iter_mut().enumerate() {
                let own = channel.sensor();
                let sensor = match parameter {
                    RecordParameter::Gain(of, at) if (of, at) == (e, c) => Sensor {
                        gain: estimated,
                        ..own
                    },
                    RecordParameter::Offset(of, at) if (of, at) == (e, c) => Sensor {
                        offset: estimated,
                        ..own
                    },
                    RecordParameter::Drift(of, at) if (of, at) == (e, c) => Sensor {
                        drift: estimated,
                        ..own
                    },
                    RecordParameter::Delay(of) if of == e => Sensor {
                        delay: estimated,
                        ..own
                    },
                    _ => continue,
                };
                *channel = channel.clone().with_sensor(sensor);
            }
        }
    });
    Some((changed.ok()?, [theta, &[start]].concat()))
}
