//! Makes the records of `data/` that stand for measurements: systems of known values, simulated on a
//! fine grid, read by sensors with noise, and written as instruments write.
//!
//! `cargo run --example make_records -- data`

use kmcfit::results::write_whole;
use kmcfit_core::record::ChannelKind;
use kmcfit_core::step::{Trajectory, observe};
use kmcfit_core::structure::{Law, Structure};
use kmcfit_core::system::{
    Excitation, Grid, InputSample, Method, NodalCoefficients, StageSamples, State, System,
    TimePoint,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::{Path, PathBuf};

const GRAVITY: f64 = 9.80665;
/// Steps of the simulation between two samples.
const FINE: usize = 16;

/// A function of time.
type Function<'a> = &'a dyn Fn(f64) -> f64;

/// A system, its input and the duration of its record.
struct Run<'a> {
    mass: f64,
    terms: Vec<(Law, Function<'a>)>,
    force: Option<Function<'a>>,
    /// Acceleration of the base, m/s^2.
    base: Option<Function<'a>>,
    initial: State,
    /// Samples per s, and their number.
    rate: f64,
    count: usize,
}

impl Run<'_> {
    fn time(&self, i: usize) -> f64 {
        i as f64 / self.rate
    }

    /// Displacement and acceleration at the times of the samples.
    fn response(&self) -> (Vec<f64>, Vec<f64>) {
        let nodes = FINE * (self.count - 1) + 1;
        let grid = Grid::new(0.0, self.time(self.count - 1), nodes).expect("a grid");
        let at_nodes = |f: Function| grid.times().iter().map(|t| f(*t)).collect();
        let nodal = NodalCoefficients {
            inertias: vec![vec![self.mass; nodes]],
            coefficients: self.terms.iter().map(|(_, p)| at_nodes(*p)).collect(),
        };
        let system = System {
            grid,
            method: Method::Rk4,
            structure: Structure::one(self.terms.iter().map(|(term, _)| *term).collect()),
        };
        let steps = |f: Function| {
            let step = |i: usize| {
                let (a, b) = (grid.time(i), grid.time(i + 1));
                [f(a), f(0.5 * (a + b)), f(b)]
            };
            StageSamples::new((0..nodes - 1).map(step))
        };
        let excitation = Excitation::one(self.force.map(steps), self.base.map(steps));
        let response: Trajectory = system
            .forward(&nodal, &self.initial, Some(&excitation))
            .expect("a motion");
        let samples = 0..self.count;
        let acceleration = samples.clone().map(|i| {
            let around = InputSample {
                force: self.force.map_or(0.0, |f| f(self.time(i))),
                base: self.base.map_or(0.0, |b| b(self.time(i))),
            };
            let position = TimePoint::node(FINE * i, nodes);
            let kind = ChannelKind::Acceleration;
            let excitation = Some(&excitation);
            observe(
                &system, kind, &nodal, excitation, &response, position, around,
            )
            .value
        });
        let acceleration = acceleration.collect();
        (
            samples
                .map(|i| response.displacement(0)[FINE * i])
                .collect(),
            acceleration,
        )
    }
}

/// Noise with a seed.
struct Noise(ChaCha8Rng);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    fn next(&mut self, sigma: f64) -> f64 {
        let z: f64 = StandardNormal.sample(&mut self.0);
        sigma * z
    }
}

fn state(displacement: f64, velocity: f64) -> State {
    State::one(displacement, velocity)
}

fn linear<'a>(c: Function<'a>, k: Function<'a>) -> Vec<(Law, Function<'a>)> {
    vec![(Law::Damping, c), (Law::Stiffness, k)]
}

/// A ring-down of 2 kg on a spring that softens from 3000 to 2700 N/m, c = 1.2 N s/m, read in g at
/// 400 Hz by an accelerometer with an offset of 0.05 g and noise of 0.01 g, as a data logger writes
/// it: preamble, semicolons, decimal commas, a row of units, Windows line ends, lost samples.
pub fn accelerometer() -> String {
    let run = Run {
        mass: 2.0,
        terms: linear(&|_| 1.2, &|t| 3000.0 - 100.0 * t),
        force: None,
        base: None,
        initial: state(0.004, 0.1),
        rate: 400.0,
        count: 1201,
    };
    let (_, acceleration) = run.response();
    let mut noise = Noise::new(11);
    let mut text = String::from(
        "Data logger DL-4\r\nChannel 1: accelerometer\r\nSample rate: 400 Hz\r\n\r\nTime;Acc 1\r\ns;g\r\n",
    );
    for (i, a) in acceleration.iter().enumerate() {
        let sample = a / GRAVITY + 0.05 + noise.next(0.01);
        let lost = i % 397 == 300;
        let field = if lost {
            String::new()
        } else {
            format!("{sample:.4}")
        };
        let line = format!("{:.4};{field}\r\n", run.time(i));
        text += &line.replace('.', ",");
    }
    text
}

/// The system of the hammer tests and the shaker run: 1.2 kg, 0.9 N s/m, 480 N/m.
const TESTED: [f64; 3] = [1.2, 0.9, 480.0];

/// A hammer test: displacement in mm after a blow, noise of 0.02 mm.
pub fn hammer(number: u64) -> String {
    let blows = [state(0.0, 0.25), state(0.006, -0.1), state(-0.004, 0.2)];
    let run = Run {
        mass: TESTED[0],
        terms: linear(&|_| TESTED[1], &|_| TESTED[2]),
        force: None,
        base: None,
        initial: blows[number as usize - 1].clone(),
        rate: 100.0,
        count: 301,
    };
    let (y, _) = run.response();
    let mut noise = Noise::new(20 + number);
    let mut text = String::from("t_s,y [mm]\n");
    for (i, y) in y.iter().enumerate() {
        let sample = 1e3 * y + noise.next(0.02);
        let _ = writeln!(text, "{:.2},{sample:.4}", run.time(i));
    }
    text
}

/// The shaker run of the same system: force in N (a sweep from 1 to 6 Hz) and acceleration in m/s^2 with
/// noise of 0.02.
pub fn shaker() -> String {
    let sweep = |t: f64| 1.5 * libm::sin(TAU * (t + 5.0 / 16.0 * t * t));
    let run = Run {
        mass: TESTED[0],
        terms: linear(&|_| TESTED[1], &|_| TESTED[2]),
        force: Some(&sweep),
        base: None,
        initial: state(0.0, 0.0),
        rate: 200.0,
        count: 1601,
    };
    let (_, acceleration) = run.response();
    let mut noise = Noise::new(30);
    let mut text = String::from("t_s,f_N,a_m_per_s2\n");
    for (i, a) in acceleration.iter().enumerate() {
        let t = run.time(i);
        let sample = a + noise.next(0.02);
        let _ = writeln!(text, "{t:.3},{:.6},{sample:.5}", sweep(t));
    }
    text
}

/// A Duffing oscillator (1 kg, 0.4 N s/m, 10 N/m, 30 N/m^3) under three sines, displacement in m with
/// noise of 1 %.
pub fn duffing() -> String {
    let force = |t: f64| {
        4.0 * libm::sin(TAU * 0.35 * t)
            + 3.0 * libm::sin(TAU * 0.8 * t + 1.0)
            + 2.0 * libm::sin(TAU * 1.3 * t + 2.0)
    };
    let mut terms = linear(&|_| 0.4, &|_| 10.0);
    terms.push((Law::CubicStiffness, &|_| 30.0));
    let run = Run {
        mass: 1.0,
        terms,
        force: Some(&force),
        base: None,
        initial: state(0.2, 0.0),
        rate: 40.0,
        count: 1201,
    };
    with_force(&run, &force, 0.007, 40)
}

/// A mass with Coulomb friction (1 kg, 0.3 N s/m, 40 N/m, friction 2 N smoothed over 0.01 m/s) under a
/// sine of 6 N at 0.5 Hz, which sticks in part of each cycle; displacement in m with noise of 1 %.
pub fn friction() -> String {
    let force = |t: f64| 6.0 * libm::sin(TAU * 0.5 * t);
    let mut terms = linear(&|_| 0.3, &|_| 40.0);
    terms.push((Law::CoulombFriction { width: 0.01 }, &|_| 2.0));
    let run = Run {
        mass: 1.0,
        terms,
        force: Some(&force),
        base: None,
        initial: state(0.0, 0.0),
        rate: 100.0,
        count: 1201,
    };
    with_force(&run, &force, 0.001, 50)
}

fn with_force(run: &Run, force: Function, sigma: f64, seed: u64) -> String {
    let (y, _) = run.response();
    let mut noise = Noise::new(seed);
    let mut text = String::from("t_s,f_N,y_m\n");
    for (i, y) in y.iter().enumerate() {
        let t = run.time(i);
        let sample = y + noise.next(sigma);
        let _ = writeln!(text, "{t:.3},{:.6},{sample:.6}", force(t));
    }
    text
}

/// The roll of a ship model after release (inertia 20 kg m^2, stiffness 130 N m/rad, damping 0.4, quadratic
/// damping 3, cubic stiffness 60), in degrees with noise of 0.02 degrees.
pub fn roll() -> String {
    let mut terms = linear(&|_| 0.4, &|_| 130.0);
    terms.push((Law::CubicStiffness, &|_| 60.0));
    terms.push((Law::QuadraticDamping, &|_| 3.0));
    let run = Run {
        mass: 20.0,
        terms,
        force: None,
        base: None,
        initial: state(0.2, 0.0),
        rate: 20.0,
        count: 1001,
    };
    let (y, _) = run.response();
    let mut noise = Noise::new(60);
    let mut text = String::from("t_s\troll [deg]\n");
    for (i, y) in y.iter().enumerate() {
        let sample = y.to_degrees() + noise.next(0.02);
        let _ = writeln!(text, "{:.2}\t{sample:.3}", run.time(i));
    }
    text
}

/// A mass of 1 kg on a spring whose stiffness varies between about 16,000 and 36,000 N/m, shaken by a force
/// that is not measured; acceleration in m/s^2 with noise, and the true natural frequency beside it.
pub fn moving_support() -> String {
    let stiffness = |t: f64| {
        let f = 24.0 + 4.0 * libm::sin(TAU * 0.35 * t) + 2.0 * libm::sin(TAU * 0.9 * t + 1.0);
        (TAU * f).powi(2)
    };
    let mut random = Noise::new(70);
    let lines: Vec<[f64; 3]> = (0..60)
        .map(|i| {
            let f = 10.0 + 0.6 * f64::from(i);
            [f + random.next(0.1), random.next(3.0), random.next(3.0)]
        })
        .collect();
    let force = |t: f64| {
        let line = |[f, a, b]: &[f64; 3]| {
            let x = TAU * f * t;
            a * libm::sin(x) + b * libm::cos(x)
        };
        lines.iter().map(line).sum()
    };
    let run = Run {
        mass: 1.0,
        terms: linear(&|_| 3.0, &stiffness),
        force: Some(&force),
        base: None,
        initial: state(0.0, 0.0),
        rate: 400.0,
        count: 2401,
    };
    let (_, acceleration) = run.response();
    let mut text = String::from("t_s,a_m_per_s2,true_f_Hz\n");
    for (i, a) in acceleration.iter().enumerate() {
        let t = run.time(i);
        let frequency = stiffness(t).sqrt() / TAU;
        let sample = a + random.next(0.2);
        let _ = writeln!(text, "{t:.4},{sample:.4},{frequency:.5}");
    }
    text
}

/// A mass on a shaking table (0.5 kg, 0.8 N s/m, 300 N/m): acceleration of the table and of the mass,
/// both in g, noise of 0.002 g.
pub fn table() -> String {
    let base = |t: f64| {
        3.0 * libm::sin(TAU * 1.7 * t)
            + 2.0 * libm::sin(TAU * 3.1 * t + 0.5)
            + 1.5 * libm::sin(TAU * 5.3 * t + 2.0)
    };
    let run = Run {
        mass: 0.5,
        terms: linear(&|_| 0.8, &|_| 300.0),
        force: None,
        base: Some(&base),
        initial: state(0.0, 0.0),
        rate: 200.0,
        count: 1001,
    };
    let (_, acceleration) = run.response();
    let mut noise = Noise::new(80);
    let mut text = String::from("t_s,table (g),mass (g)\n");
    for (i, a) in acceleration.iter().enumerate() {
        let t = run.time(i);
        let absolute = (a + base(t)) / GRAVITY + noise.next(0.002);
        let _ = writeln!(text, "{t:.3},{:.7},{absolute:.5}", base(t) / GRAVITY);
    }
    text
}

/// A free decay (1 kg, 0.2 N s/m, 25 N/m) photographed at irregular times: a gap, missing samples, one
/// sample in twenty an outlier, a sensor that drifts by 2 mm/s; in m with noise of 2 mm.
pub fn camera() -> String {
    let run = Run {
        mass: 1.0,
        terms: linear(&|_| 0.2, &|_| 25.0),
        force: None,
        base: None,
        initial: state(0.3, 0.0),
        rate: 1000.0,
        count: 15001,
    };
    let (y, _) = run.response();
    let mut random = Noise::new(90);
    let mut text = String::from("t_s,y_m\n");
    let mut i = 0usize;
    while i < y.len() {
        let t = run.time(i);
        let good = y[i] + 0.002 * t + random.next(0.002);
        let far = random.next(1.0);
        let blind = random.next(1.0);
        let sample = if far.abs() > 1.96 {
            good + 0.1 * far
        } else {
            good
        };
        if !(6.0..7.5).contains(&t) {
            match blind.abs() > 2.0 {
                true => _ = writeln!(text, "{t:.3},"),
                false => _ = writeln!(text, "{t:.3},{sample:.5}"),
            }
        }
        // From 15 to some 50 ms to the next picture.
        i += 15 + (random.next(10.0).abs() as usize);
    }
    text
}

/// Tests of a footbridge: file, date, air temperature in degrees Celsius.
const FOOTBRIDGE: [(&str, &str, f64); 12] = [
    ("footbridge_01.csv", "2025-01-14", -3.0),
    ("footbridge_02.csv", "2025-02-11", 1.0),
    ("footbridge_03.csv", "2025-03-12", 7.0),
    ("footbridge_04.csv", "2025-04-15", 11.0),
    ("footbridge_05.csv", "2025-05-13", 16.0),
    ("footbridge_06.csv", "2025-06-17", 22.0),
    ("footbridge_07.csv", "2025-07-15", 27.0),
    ("footbridge_08.csv", "2025-08-12", 25.0),
    ("footbridge_09.csv", "2025-09-16", 18.0),
    ("footbridge_10.csv", "2025-10-14", 12.0),
    ("footbridge_11.csv", "2025-11-11", 5.0),
    ("footbridge_12.csv", "2025-12-09", 0.0),
];

/// Modal mass of the footbridge, kg.
const BRIDGE_MASS: f64 = 12_000.0;

/// A ring-down of a footbridge of 12 t modal mass and 2.05 Hz at 10 degrees, whose stiffness falls by 0.16 % per degree, with 0.6 %
/// damping; in September a bearing is loose and the stiffness 6 % lower. Accelerations in m/s^2 at 40 Hz with noise of 0.01.
fn footbridge(test: usize) -> String {
    let (_, _, temperature) = FOOTBRIDGE[test];
    let omega = TAU * 2.05;
    let loose = if test == 8 { 0.94 } else { 1.0 };
    let k = loose * BRIDGE_MASS * omega * omega * (1.0 - 0.0016 * (temperature - 10.0));
    let c = 2.0 * 0.006 * (k * BRIDGE_MASS).sqrt();
    let (damping, stiffness) = (|_| c, |_| k);
    let run = Run {
        mass: BRIDGE_MASS,
        terms: linear(&damping, &stiffness),
        force: None,
        base: None,
        initial: state(0.005, 0.0),
        rate: 40.0,
        count: 601,
    };
    let (_, acceleration) = run.response();
    let mut noise = Noise::new(100 + test as u64);
    let mut text = String::from("t_s,a (m/s^2)\n");
    for (i, a) in acceleration.iter().enumerate() {
        let _ = writeln!(text, "{:.3},{:.4}", run.time(i), a + noise.next(0.01));
    }
    text
}

/// The table of these records.
fn footbridge_list() -> String {
    let mut text = String::from("file,date,temperature\n");
    for (file, date, temperature) in FOOTBRIDGE {
        let _ = writeln!(text, "{file},{date},{temperature}");
    }
    text
}

/// All files with their names.
pub fn all() -> Vec<(&'static str, String)> {
    let bridge = FOOTBRIDGE.iter().enumerate();
    let bridge = bridge.map(|(test, (file, ..))| (*file, footbridge(test)));
    let mut all = vec![
        ("accelerometer.txt", accelerometer()),
        ("hammer_1.csv", hammer(1)),
        ("hammer_2.csv", hammer(2)),
        ("hammer_3.csv", hammer(3)),
        ("shaker.csv", shaker()),
        ("duffing.csv", duffing()),
        ("friction.csv", friction()),
        ("roll.tsv", roll()),
        ("moving_support.csv", moving_support()),
        ("table.csv", table()),
        ("camera.csv", camera()),
        ("footbridge.csv", footbridge_list()),
    ];
    all.extend(bridge);
    all
}

fn main() -> std::io::Result<()> {
    let folder = std::env::args_os()
        .nth(1)
        .map_or_else(|| PathBuf::from("data"), PathBuf::from);
    for (name, text) in all() {
        write_whole(&Path::new(&folder).join(name), &text)?;
    }
    Ok(())
}
