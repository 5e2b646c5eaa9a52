//! Keys of an experiment: its file, channels, sensors, what drives it, and its beginning.

use super::Kind::{self, AnyOf, Bool, Choice, Column, Count, Map, Number, Text, Word};
use super::function::{OWN_FUNCTIONS, RANGE};
use super::{Group, Key};
use crate::config::spec::{DecimalSign, Delimiter, ForceShape, InterpolationName, LossName};

const COLUMN_REF: Kind = AnyOf(&[Column, Map(&SOURCE)]);
const SIGMA_KIND: Kind = AnyOf(&[Number, Word("estimate"), Text]);
const LOSS_KIND: Kind = AnyOf(&[Choice(LossName::NAMES), Map(&LOSS)]);
const ESTIMATE: Kind = AnyOf(&[Number, Word("estimate"), Map(&ESTIMATED)]);

pub static EXPERIMENT: Group = Group {
    name: "experiment",
    text: "One record.",
    keys: &[
        Key::new("name", Text, "What reports call it.", "free decay")
            .default("experiment 1, experiment 2, …"),
        Key::new(
            "data",
            Text,
            "File of the readings, relative to the model file; a simulation needs none.",
            "readings.csv",
        ),
        Key::new(
            "format",
            Map(&FILE_FORMAT),
            "How the file is written, where that is not to be found out from it.",
            "{delimiter: semicolon, decimal: comma}",
        )
        .default("found out from the file"),
        Key::new(
            "columns",
            Map(&COLUMNS),
            "Which columns of the file are what.",
            "{time: t_s, displacement: y_m}",
        )
        .default("{time: t_s, displacement: y_m}"),
        Key::new(
            "sample_rate",
            Number,
            "Readings per second, in place of a column of times.",
            "1000.0",
        )
        .unit("Hz"),
        Key::new(
            "units",
            Map(&UNITS),
            "Units of the columns, which are converted to SI.",
            "{displacement: mm}",
        )
        .default("what the file states, else SI"),
        Key::new(
            "window",
            Map(&RANGE),
            "First and last time that is used, as the file counts.",
            "{min: 0.1, max: 2.9}",
        )
        .unit("s")
        .default("all"),
        Key::new(
            "time_zero",
            Number,
            "Time, as the file counts, that becomes 0.",
            "0.1",
        )
        .unit("s")
        .default("0"),
        Key::new(
            "decimate",
            Count,
            "Keep every so manyth reading after a low-pass filter.",
            "4",
        )
        .default("1"),
        Key::new(
            "band",
            Map(&RANGE),
            "Frequencies outside which readings and model are filtered alike.",
            "{min: 5.0, max: 50.0}",
        )
        .unit("Hz")
        .default("all"),
        Key::new(
            "sigma",
            Map(&SIGMA),
            "Standard deviation of the readings; without it J is the paper's integral.",
            "{displacement: 0.1}",
        ),
        Key::new(
            "loss",
            Map(&LOSSES),
            "What residuals cost; needs `sigma`.",
            "{displacement: huber}",
        )
        .default("squares"),
        Key::new(
            "sensors",
            Map(&SENSORS),
            "reading = gain * motion + offset + drift * time.",
            "{acceleration: {offset: estimate}}",
        )
        .default("perfect ones"),
        Key::new(
            "force",
            Map(&FORCE),
            "Force on the mass: how the column `force` is read between its samples, or a shape in its place.",
            "{interpolation: cubic}",
        )
        .default("none, or the column `force`"),
        Key::new(
            "base",
            Map(&BASE),
            "How the motion of the base is read between its samples.",
            "{interpolation: cubic}",
        ),
        Key::new(
            "initial",
            AnyOf(&[Word("estimate"), Map(&INITIAL)]),
            "State at the beginning, or `estimate` for both of its numbers.",
            "{displacement: 3.3, velocity: 1.0}",
        )
        .required(),
        Key::new(
            "functions",
            Map(&OWN_FUNCTIONS),
            "Functions that this experiment does not share with the others.",
            "{damping: {basis: constant, start: 1.0}}",
        )
        .default("all are shared"),
        Key::new(
            "hold_out",
            Bool,
            "Whether it is kept out of the fit, to be predicted and scored.",
            "true",
        )
        .default("false"),
    ],
};

static FILE_FORMAT: Group = Group {
    name: "file_format",
    text: "How a file of readings is written.",
    keys: &[
        Key::new(
            "delimiter",
            Choice(Delimiter::NAMES),
            "What separates fields.",
            "semicolon",
        )
        .default("found out"),
        Key::new(
            "decimal",
            Choice(DecimalSign::NAMES),
            "What separates the decimals of a number.",
            "comma",
        )
        .default("found out"),
        Key::new("skip", Count, "Lines before the row of column names.", "4").default("found out"),
        Key::new(
            "header",
            Bool,
            "Whether there is a row of column names.",
            "true",
        )
        .default("found out"),
        Key::new(
            "units_row",
            Bool,
            "Whether a row of units follows it.",
            "true",
        )
        .default("found out"),
    ],
};

const fn column(name: &'static str, text: &'static str, example: &'static str) -> Key {
    Key::new(name, COLUMN_REF, text, example)
}

static COLUMNS: Group = Group {
    name: "columns",
    text: "Which columns of a file are what, by name or by number from 1.",
    keys: &[
        Key::new("time", Column, "Times.", "t_s").default("t_s"),
        column("displacement", "Displacement.", "y_m").default("y_m, if no other channel is named"),
        column("velocity", "Velocity.", "v_m_per_s"),
        column("acceleration", "Acceleration.", "a_m_per_s2"),
        column("force", "Force on the mass.", "f_N"),
        column(
            "base_acceleration",
            "Acceleration of the base; y is relative to the base then.",
            "table_g",
        ),
        column(
            "base_displacement",
            "Displacement of the base; y is relative to the base then.",
            "table_mm",
        ),
    ],
};

static SOURCE: Group = Group {
    name: "source",
    text: "A column with a file or times of its own.",
    keys: &[
        Key::new(
            "data",
            Text,
            "File, relative to the model file.",
            "other.csv",
        )
        .default("that of the experiment"),
        Key::new("column", Column, "Column of the values.", "y_m").required(),
        Key::new("time", Column, "Column of the times.", "t_s").default("that of the experiment"),
        Key::new(
            "sample_rate",
            Number,
            "Readings per second, in place of a column of times.",
            "1000.0",
        )
        .unit("Hz"),
    ],
};

static UNITS: Group = Group {
    name: "units",
    text: "Units of the columns: mm, deg, g, kN, ms, …",
    keys: &[
        Key::new("time", Text, "Of the times.", "ms").default("s"),
        Key::new("displacement", Text, "Of the displacement.", "mm").default("m"),
        Key::new("velocity", Text, "Of the velocity.", "mm/s").default("m/s"),
        Key::new("acceleration", Text, "Of the acceleration.", "g").default("m/s^2"),
        Key::new("force", Text, "Of the force.", "kN").default("N"),
        Key::new(
            "base_acceleration",
            Text,
            "Of the acceleration of the base.",
            "g",
        )
        .default("m/s^2"),
        Key::new(
            "base_displacement",
            Text,
            "Of the displacement of the base.",
            "mm",
        )
        .default("m"),
    ],
};

static SIGMA: Group = Group {
    name: "sigma",
    text: "Standard deviation of a reading: a number, a column of the file, or `estimate`.",
    keys: &[
        Key::new("displacement", SIGMA_KIND, "Of the displacement.", "0.1").unit("m"),
        Key::new("velocity", SIGMA_KIND, "Of the velocity.", "0.1").unit("m/s"),
        Key::new(
            "acceleration",
            SIGMA_KIND,
            "Of the acceleration.",
            "estimate",
        )
        .unit("m/s^2"),
    ],
};

static LOSSES: Group = Group {
    name: "losses",
    text: "What the residuals of each channel cost.",
    keys: &[
        Key::new("displacement", LOSS_KIND, "Of the displacement.", "huber").default("squares"),
        Key::new("velocity", LOSS_KIND, "Of the velocity.", "student-t").default("squares"),
        Key::new(
            "acceleration",
            LOSS_KIND,
            "Of the acceleration.",
            "{name: huber, threshold: 1.345}",
        )
        .default("squares"),
    ],
};

static LOSS: Group = Group {
    name: "loss",
    text: "A loss with its settings.",
    keys: &[
        Key::new("name", Choice(LossName::NAMES), "Which loss.", "huber").required(),
        Key::new(
            "threshold",
            Number,
            "Of `huber`: where squares end.",
            "1.345",
        )
        .unit("standard deviations")
        .default("1.345"),
        Key::new(
            "degrees",
            Number,
            "Of `student-t`: degrees of freedom.",
            "4.0",
        )
        .default("4"),
    ],
};

static SENSORS: Group = Group {
    name: "sensors",
    text: "Sensors, per channel: reading = gain * motion + offset + drift * time.",
    keys: &[
        Key::new(
            "displacement",
            Map(&SENSOR),
            "Of the displacement.",
            "{drift: estimate}",
        ),
        Key::new(
            "velocity",
            Map(&SENSOR),
            "Of the velocity.",
            "{gain: estimate}",
        ),
        Key::new(
            "acceleration",
            Map(&SENSOR),
            "Of the acceleration.",
            "{offset: estimate}",
        ),
    ],
};

static SENSOR: Group = Group {
    name: "sensor",
    text: "What a sensor makes of the motion.",
    keys: &[
        Key::new("gain", ESTIMATE, "Factor.", "1.0").default("1"),
        Key::new("offset", ESTIMATE, "Reading at rest.", "estimate")
            .unit("SI unit of the channel")
            .default("0"),
        Key::new(
            "drift",
            ESTIMATE,
            "Change of the offset with time.",
            "estimate",
        )
        .unit("SI unit of the channel per s")
        .default("0"),
        Key::new(
            "absolute",
            Bool,
            "Whether it measures the motion in space and not relative to the base.",
            "true",
        )
        .default("true for accelerations, false for the others"),
    ],
};

static ESTIMATED: Group = Group {
    name: "estimate",
    text: "A number that is sought with the functions.",
    keys: &[
        Key::new("start", Number, "Where the search starts.", "1.0")
            .default("what the readings say"),
        Key::new(
            "prior",
            Map(&PRIOR),
            "What is known of it: adds ((x - mean)/sigma)^2 to J.",
            "{mean: 1.0, sigma: 0.1}",
        )
        .default("nothing"),
    ],
};

static PRIOR: Group = Group {
    name: "prior",
    text: "What is known of a number before the fit.",
    keys: &[
        Key::new("mean", Number, "Expected value.", "1.0").required(),
        Key::new("sigma", Number, "Standard deviation.", "0.1").required(),
    ],
};

pub static FORCE: Group = Group {
    name: "force",
    text: "Force on the mass: a column with its interpolation, or a shape.",
    keys: &[
        Key::new(
            "interpolation",
            Choice(InterpolationName::NAMES),
            "Between the samples of the column `force`.",
            "cubic",
        )
        .default("linear"),
        Key::new(
            "shape",
            Choice(ForceShape::NAMES),
            "A shape in place of a column.",
            "sine",
        ),
        Key::new("amplitude", Number, "Largest value of a shape.", "1.0").unit("N"),
        Key::new("frequency", Number, "Of a sine.", "1.5").unit("Hz"),
        Key::new("phase", Number, "Of a sine at time 0.", "0.7")
            .unit("rad")
            .default("0"),
        Key::new("from", Number, "First frequency of a sweep.", "0.5").unit("Hz"),
        Key::new("to", Number, "Last frequency of a sweep.", "5.0").unit("Hz"),
        Key::new(
            "at",
            Number,
            "Where a step, a half-sine or a sweep begins.",
            "1.0",
        )
        .unit("s")
        .default("0"),
        Key::new(
            "duration",
            Number,
            "How long a half-sine or a sweep lasts.",
            "0.1",
        )
        .unit("s"),
    ],
};

static BASE: Group = Group {
    name: "base",
    text: "Motion of the base.",
    keys: &[Key::new(
        "interpolation",
        Choice(InterpolationName::NAMES),
        "Between the samples of the column of the base.",
        "cubic",
    )
    .default("linear")],
};

static INITIAL: Group = Group {
    name: "initial",
    text: "State at the beginning: each number known, `estimate`, or an estimate with a start or a prior.",
    keys: &[
        Key::new(
            "displacement",
            ESTIMATE,
            "Displacement at the beginning.",
            "3.3",
        )
        .unit("m")
        .required(),
        Key::new("velocity", ESTIMATE, "Velocity at the beginning.", "1.0")
            .unit("m/s")
            .required(),
    ],
};

/// A state of the oscillator.
pub static STATE: Group = Group {
    name: "state",
    text: "A state of the oscillator.",
    keys: &[
        Key::new("displacement", Number, "Displacement.", "3.3")
            .unit("m")
            .required(),
        Key::new("velocity", Number, "Velocity.", "1.0")
            .unit("m/s")
            .required(),
    ],
};
