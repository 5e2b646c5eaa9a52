//! Keys of the functions, their penalties, and the constraints on them.

use super::Kind::{AnyOf, Bool, Choice, Count, List, Map, Number, Text};
use super::{Group, Key, NUMBER_OR_COLUMN, NUMBERS};
use crate::config::spec::{Basis, FunctionName, ShapeName, WeightRule};

const fn function(
    name: &'static str,
    text: &'static str,
    unit: &'static str,
    example: &'static str,
) -> Key {
    Key::new(name, Map(&FUNCTION), text, example).unit(unit)
}

const CUBIC: Key = function(
    "cubic_stiffness",
    "Cubic stiffness: a force on y^3.",
    "N/m^3",
    "{basis: constant, start: 0.0}",
);
const QUADRATIC: Key = function(
    "quadratic_damping",
    "Quadratic damping: a force on |v| v.",
    "N s^2/m^2",
    "{basis: constant, start: 0.0}",
);
const COULOMB: Key = function(
    "coulomb_friction",
    "Coulomb friction: a force on v/sqrt(v^2 + width^2).",
    "N",
    "{basis: constant, start: 0.5, width: 0.01}",
);
const OFFSET: Key = function(
    "offset",
    "A constant push against the direction of y.",
    "N",
    "{fixed: 0.0}",
);

pub static FUNCTIONS: Group = Group {
    name: "functions",
    text: "The functions of the device; mass, damping and stiffness must be there.",
    keys: &[
        function("mass", "Mass m(t).", "kg", "{basis: nodal, start: 2.0}").required(),
        function(
            "damping",
            "Damping c(t): a force on v.",
            "N s/m",
            "{basis: constant, start: 1.0}",
        )
        .required(),
        function(
            "stiffness",
            "Stiffness k(t): a force on y.",
            "N/m",
            "{fixed: 1.0}",
        )
        .required(),
        CUBIC.default("no such force"),
        QUADRATIC.default("no such force"),
        COULOMB.default("no such force"),
        OFFSET.default("no such force"),
    ],
};

pub static OWN_FUNCTIONS: Group = Group {
    name: "own_functions",
    text: "Functions that one experiment does not share with the others.",
    keys: &[
        function(
            "mass",
            "Mass m(t) of this experiment.",
            "kg",
            "{basis: constant, start: 2.0}",
        ),
        function(
            "damping",
            "Damping c(t) of this experiment.",
            "N s/m",
            "{basis: constant, start: 1.0}",
        ),
        function(
            "stiffness",
            "Stiffness k(t) of this experiment.",
            "N/m",
            "{basis: constant, start: 1.0}",
        ),
        CUBIC,
        QUADRATIC,
        COULOMB,
        OFFSET,
    ],
};

static FUNCTION: Group = Group {
    name: "function",
    text: "One function: sought, with a basis and a start, or fixed.",
    keys: &[
        Key::new(
            "basis",
            Choice(Basis::NAMES),
            "Shape of the function over time, and so what its free values are.",
            "piecewise-linear",
        ),
        Key::new(
            "knots",
            AnyOf(&[Count, List(&Number)]),
            "Break points of a piecewise function or a spline: how many, equally spaced with both ends, or their times.",
            "11",
        )
        .unit("s, of times"),
        Key::new("degree", Count, "Degree of a polynomial.", "2"),
        Key::new(
            "start",
            AnyOf(&[Number, List(&Number), Map(&COLUMN)]),
            "Where the search starts: one number, one value per node, cell or knot, the factors of a polynomial, or a column of a file.",
            "2.0",
        )
        .unit("that of the function"),
        Key::new(
            "fixed",
            NUMBER_OR_COLUMN,
            "Known values, which are not fitted; in place of `basis`.",
            "1.0",
        )
        .unit("that of the function"),
        Key::new(
            "min",
            NUMBER_OR_COLUMN,
            "Smallest value allowed.",
            "0.05",
        )
        .unit("that of the function")
        .default("none"),
        Key::new("max", NUMBER_OR_COLUMN, "Largest value allowed.", "10.0")
            .unit("that of the function")
            .default("none"),
        Key::new(
            "smooth",
            AnyOf(&[Map(&SMOOTH), List(&Map(&SMOOTH))]),
            "Penalty on squared derivatives, added to J; or a list of such.",
            "{order: 2, weight: 0.1}",
        )
        .default("none"),
        Key::new(
            "variation",
            Map(&VARIATION),
            "Penalty on the total variation: a jump costs no more than a slow change.",
            "{weight: 0.01}",
        )
        .default("none"),
        Key::new(
            "width",
            Number,
            "Of Coulomb friction: speed over which the sign of the velocity is smoothed, well below the speeds of the motion.",
            "0.01",
        )
        .unit("m/s"),
    ],
};

static SMOOTH: Group = Group {
    name: "smooth",
    text: "A penalty: weight times the integral of the squared derivative.",
    keys: &[
        Key::new(
            "order",
            Count,
            "Which derivative: 0 (distance from `reference`), 1 (slope) or 2 (curvature).",
            "2",
        )
        .required(),
        Key::new(
            "weight",
            AnyOf(&[Number, Choice(WeightRule::NAMES)]),
            "Factor of the penalty in J, or the rule that chooses it from the data.",
            "0.1",
        )
        .unit("of J per unit of the integral")
        .required(),
        Key::new(
            "reference",
            NUMBER_OR_COLUMN,
            "What a penalty of order 0 pulls towards.",
            "1.0",
        )
        .unit("that of the function")
        .default("0"),
    ],
};

static VARIATION: Group = Group {
    name: "variation",
    text: "A penalty: weight times the total variation.",
    keys: &[
        Key::new("weight", Number, "Factor of the penalty in J.", "0.01")
            .unit("of J per unit of the function")
            .required(),
    ],
};

pub static COLUMN: Group = Group {
    name: "column",
    text: "A column of a file with times in `t_s`, read linearly between its rows.",
    keys: &[
        Key::new(
            "data",
            Text,
            "The file, relative to the model file; the `functions.csv` of a finished run is one.",
            "device.csv",
        )
        .required(),
        Key::new("column", Text, "Name of the column.", "mass_kg").required(),
    ],
};

pub static RANGE: Group = Group {
    name: "range",
    text: "A range; either end may be missing.",
    keys: &[
        Key::new("min", Number, "Lower end.", "0.1").default("open"),
        Key::new("max", Number, "Upper end.", "0.5").default("open"),
    ],
};

pub static CONSTRAINT: Group = Group {
    name: "constraint",
    text: "One demand on the functions.",
    keys: &[
        Key::new(
            "function",
            Choice(FunctionName::NAMES),
            "Which function it is about.",
            "mass",
        ),
        Key::new(
            "min",
            NUMBER_OR_COLUMN,
            "Smallest value allowed, at all times.",
            "0.05",
        )
        .unit("that of the function"),
        Key::new(
            "max",
            NUMBER_OR_COLUMN,
            "Largest value allowed, at all times.",
            "10.0",
        )
        .unit("that of the function"),
        Key::new(
            "slope",
            Map(&RANGE),
            "Smallest and largest slope.",
            "{min: -0.2, max: 0.0}",
        )
        .unit("that of the function per s"),
        Key::new(
            "shape",
            AnyOf(&[Choice(ShapeName::NAMES), List(&Choice(ShapeName::NAMES))]),
            "Monotone, or curved in one direction; or a list of such.",
            "non-increasing",
        ),
        Key::new("at", NUMBERS, "Times at which the value is held.", "0.0").unit("s"),
        Key::new(
            "value",
            NUMBERS,
            "Values at these times, one for all or one each.",
            "1.0",
        )
        .unit("that of the function"),
        Key::new("mean", Number, "Mean over the record.", "0.75").unit("that of the function"),
        Key::new("integral", Number, "Integral over the record.", "18.75")
            .unit("that of the function times s"),
        Key::new(
            "equal",
            List(&Choice(FunctionName::NAMES)),
            "Two functions: the first is `ratio` times the second.",
            "[damping, stiffness]",
        ),
        Key::new(
            "ratio",
            Number,
            "Factor of the second function of `equal`.",
            "0.1",
        )
        .default("1"),
        Key::new(
            "passive",
            Bool,
            "The stored energy never grows: c - m'/2 >= 0 and k' <= 0.",
            "true",
        ),
        Key::new(
            "frequency",
            Map(&RANGE),
            "Band of the natural frequency sqrt(k/m)/2π, at every instant.",
            "{min: 0.1, max: 0.3}",
        )
        .unit("Hz"),
        Key::new(
            "damping_ratio",
            Map(&RANGE),
            "Cap on the size of c/(2 sqrt(k m)).",
            "{max: 0.2}",
        ),
        Key::new(
            "soft",
            Number,
            "The price of breaking it: a weight on the mean squared excess.",
            "10.0",
        )
        .default("it holds"),
    ],
};
