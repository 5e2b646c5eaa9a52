//! Records and models with extreme numbers.

/// The system of all records, with constant coefficients: `m y'' + c y' + k y = 0`, `y(0)` given, `y'(0) = 0`.
#[derive(Clone, Copy)]
pub struct Device {
    pub mass: f64,
    pub damping: f64,
    pub stiffness: f64,
    pub begin: f64,
}

/// System with a period of about 3.1 s.
pub const CALM: Device = Device {
    mass: 1.0,
    damping: 0.1,
    stiffness: 4.0,
    begin: 1.0,
};

impl Device {
    /// The displacement, of slow decay or of overdamped return.
    fn at(self, t: f64) -> f64 {
        let rate = self.damping / (2.0 * self.mass);
        let square = self.stiffness / self.mass - rate * rate;
        let angular = square.abs().sqrt();
        self.begin
            * match square > 0.0 {
                true => {
                    let swing = (angular * t).cos() + rate / angular * (angular * t).sin();
                    (-rate * t).exp() * swing
                }
                false => {
                    // The fast root from the sum, the slow one from the product: no cancellation.
                    let fast = -(rate + angular);
                    let slow = self.stiffness / self.mass / fast;
                    (fast * (slow * t).exp() - slow * (fast * t).exp()) / (fast - slow)
                }
            }
    }
}

/// A record and its model.
pub struct Case {
    pub name: &'static str,
    pub device: Device,
    /// Times of the samples, s.
    pub times: Vec<f64>,
    /// The samples, as a function of the displacement.
    pub spoil: fn(usize, f64) -> String,
    /// Start of mass and damping.
    pub start: [f64; 2],
    /// The key `grid`.
    pub grid: &'static str,
    pub sigma: Option<f64>,
    pub iterations: u32,
}

fn plain(_: usize, y: f64) -> String {
    format!("{y:.12e}")
}

fn times(count: usize, spacing: f64) -> Vec<f64> {
    (0..count).map(|i| i as f64 * spacing).collect()
}

/// A record of the system over about three periods, with a start that converges to it.
fn case(name: &'static str, device: Device) -> Case {
    Case {
        name,
        device,
        times: times(201, 0.05),
        spoil: plain,
        start: [1.5 * device.mass, 3.0 * device.damping],
        grid: "{}",
        sigma: None,
        iterations: 50,
    }
}

/// The calm case with time in other units.
fn at_pace(name: &'static str, second: f64) -> Case {
    let device = Device {
        damping: CALM.damping / second,
        stiffness: CALM.stiffness / (second * second),
        ..CALM
    };
    Case {
        times: times(201, 0.05 * second),
        ..case(name, device)
    }
}

/// All cases; the first is the calm one.
pub fn cases() -> Vec<Case> {
    let calm = |name| case(name, CALM);
    let with = |change: fn(&mut Device)| {
        let mut device = CALM;
        change(&mut device);
        device
    };
    vec![
        calm("calm"),
        case("a stiff spring", with(|d| d.stiffness = 1e8)),
        case("a stiff damper", with(|d| d.damping = 1e5)),
        case("hardly any mass", with(|d| d.mass = 1e-9)),
        Case {
            grid: "{nodes: 1000001}",
            iterations: 3,
            ..calm("a million steps")
        },
        Case {
            times: times(5, 0.5),
            ..calm("five samples")
        },
        Case {
            spoil: |_, _| "1".into(),
            ..calm("constant samples")
        },
        Case {
            spoil: |_, _| "0".into(),
            ..case("nothing moves", with(|d| d.begin = 0.0))
        },
        Case {
            times: times(64, 0.05),
            ..calm("one period")
        },
        Case {
            times: times(11, 3.0),
            grid: "{nodes: 601}",
            ..calm("too few samples per period")
        },
        case("amplitude 1e-12", with(|d| d.begin = 1e-12)),
        case("amplitude 1e12", with(|d| d.begin = 1e12)),
        case("amplitude 1e-170", with(|d| d.begin = 1e-170)),
        case("amplitude 1e170", with(|d| d.begin = 1e170)),
        Case {
            spoil: |i, y| match i {
                100 => "1e300".into(),
                i => plain(i, y),
            },
            ..calm("an outlier of 1e300")
        },
        Case {
            spoil: |i, y| match i {
                100 => "1e9".into(),
                i => plain(i, y),
            },
            ..calm("an outlier of 1e9")
        },
        Case {
            spoil: |_, _| "NaN".into(),
            ..calm("no sample at all")
        },
        Case {
            spoil: |i, y| match i {
                100 => plain(i, y),
                _ => "NaN".into(),
            },
            ..calm("one sample")
        },
        Case {
            times: [
                vec![0.0],
                times(20, 1e-7).iter().map(|t| 5.0 + t).collect(),
                vec![10.0],
            ]
            .concat(),
            grid: "{nodes: 201}",
            ..calm("samples at one node")
        },
        at_pace("nanoseconds", 1e-9),
        at_pace("thirty years", 1e9),
        Case {
            start: [1e12, 0.3],
            ..calm("start with 1e12 times the mass")
        },
        Case {
            start: [1e-300, 0.3],
            ..calm("start with 1e-300 of the mass")
        },
        Case {
            sigma: Some(1e-300),
            ..calm("sigma 1e-300")
        },
        Case {
            sigma: Some(1e300),
            ..calm("sigma 1e300")
        },
        Case {
            spoil: |i, _| plain(i, (i * i * 7919 % 1013) as f64 / 506.5 - 1.0),
            ..calm("nothing but noise")
        },
    ]
}

impl Case {
    /// The model file for a method.
    pub fn model(&self, method: &str) -> String {
        let [mass, damping] = self.start;
        let equation = method == "equation-error";
        let sigma = match self.sigma {
            Some(sigma) => format!("sigma: {{displacement: {sigma:e}}}, "),
            None => String::new(),
        };
        let stop = match equation {
            true => String::new(),
            false => format!(
                ", stop: {{iterations: {}, tolerance: 1e-10}}",
                self.iterations
            ),
        };
        format!(
            "format: 1\ntitle: Storm\nexperiments:\n  - {{data: samples.csv, {sigma}initial: {{displacement: \
             {:e}, velocity: 0.0}}}}\ngrid: {}\nfunctions:\n  mass: {{basis: constant, start: \
             {mass:e}}}\n  damping: {{basis: constant, start: {damping:e}}}\n  stiffness: {{fixed: \
             {:e}}}\nfit: {{method: {method}{stop}}}\n",
            self.device.begin, self.grid, self.device.stiffness
        )
        .replace("grid: {}\n", "")
    }

    /// The table of samples.
    pub fn sample_table(&self) -> String {
        let row = |(i, t): (usize, &f64)| {
            let y = (self.spoil)(i, self.device.at(*t));
            format!("{t:.12e},{y}\n")
        };
        let rows = self.times.iter().enumerate().map(row);
        std::iter::once("t_s,y_m\n".to_owned())
            .chain(rows)
            .collect()
    }
}
