//! The list of all messages: every error that a test asserts, and every variant of warnings, findings, suggestions and
//! outcomes. `tests/snapshots/messages.snap` is this list; it is read as a whole when a message changes.

use crate::config::{DataAction, DataFact, DataWarning, GapPlace};
use crate::report::findings;
use crate::report::suggestions::{Suggestion, Suspect};
use crate::report::{assumption, reason_in_words};
use kmcfit_core::internals::assessment::{
    AmplitudeRival, ClassicalEstimate, ClassicalMethod, CoarseBasis, FitWarning, FunctionInGap,
    GapAssessment, GapStatus, Implausible, NoIntervals, RecordError, ResidualPattern, SampleFault,
    Unidentified, VerdictAssumption, VerdictReason,
};
use kmcfit_core::internals::builder::BuildNotice;
use kmcfit_core::internals::diagnostics::{UntestedReason, Whiteness, WhitenessResult};
use kmcfit_core::internals::functions::CoefficientKind;
use kmcfit_core::internals::identifiability::{Classification, Condition, FunctionClassification};
use kmcfit_core::internals::problem::ProblemError;
use kmcfit_core::internals::qp::ConicStatus;
use kmcfit_core::internals::record::ScoreCovariance;
use kmcfit_core::internals::simulate::{Cause, SimulationError};
use kmcfit_core::internals::solvers::{
    ConditionFailure, GridNotice, MissingMeasurement, MissingTerm, Reason, Status,
    UnsupportedRecord, WidthNotice,
};
use kmcfit_core::internals::study::multistart::MultistartFinding;
use kmcfit_core::internals::system::InputQuantity;
use std::collections::BTreeSet;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Samples of an enumeration. A variant without a sample does not compile, and each sample must match its pattern.
macro_rules! samples {
    ($($pattern:pat => $value:expr),+ $(,)?) => {{
        let all = vec![$({
            let value = $value;
            assert!(matches!(&value, $pattern), "{}", stringify!($pattern));
            value
        }),+];
        for value in &all {
            #[allow(unreachable_patterns, reason = "several samples of a variant")]
            match value {
                $($pattern => {})+
            }
        }
        all
    }};
}

#[test]
fn messages() {
    let mut list = String::new();
    section(&mut list, "Errors of input", asserted_errors());
    let untested = UNTESTED.into_iter().map(str::to_owned);
    section(&mut list, "Errors of input that no test compares", untested);
    let shown = |text: &dyn std::fmt::Display| text.to_string();
    let all = data_warnings();
    section(
        &mut list,
        "Warnings about data",
        all.iter().map(|w| shown(w)),
    );
    let all = data_facts();
    section(&mut list, "Facts about data", all.iter().map(|f| shown(f)));
    let all = notices();
    section(
        &mut list,
        "Notices on a model",
        all.iter().map(|n| shown(n)),
    );
    let all = grid_notices();
    section(
        &mut list,
        "Notices on an automatic grid",
        all.iter().map(|n| shown(n)),
    );
    let all = width_notices();
    section(
        &mut list,
        "Notices on an automatic width of Coulomb friction",
        all.iter().map(|n| shown(n)),
    );
    let all = statuses().into_iter().map(|s| s.name().to_owned());
    section(&mut list, "Status of a fit", all);
    let all = reasons();
    section(
        &mut list,
        "Reason of the status",
        all.iter().map(|r| shown(r)),
    );
    let all = fit_warnings();
    let all = all.iter().map(|w| findings::warning(w).text);
    section(&mut list, "Warnings about a fit", all);
    let all = verdict_reasons();
    let all = all.iter().map(|r| reason_in_words(r).text);
    section(&mut list, "Reasons of a verdict", all);
    let all = verdict_assumptions();
    let all = all.iter().map(|a| assumption(a).text);
    section(&mut list, "Assumptions of a verdict", all);
    let all = unidentified();
    let all = all.iter().map(|u| findings::unidentified(u).text);
    section(&mut list, "No system identified", all);
    let all = whiteness();
    section(
        &mut list,
        "Test of the residuals",
        all.iter().map(|w| shown(w)),
    );
    let all = classifications();
    section(
        &mut list,
        "Identifiability of a function",
        all.iter().map(|c| c.verdict.name().to_owned()),
    );
    let all = conditions().into_iter();
    let all = all.map(|condition| condition.sentence("stiffness", 0.04));
    section(&mut list, "Functions identified conditionally", all);
    let all = no_intervals();
    let all = all.iter().map(Some).chain([None]);
    let all = all.map(|reason| findings::equation_error(reason).text);
    section(&mut list, "Fits of the equation error", all);
    let level = (2.0, Some([1.95, 2.05]));
    let all = [
        findings::jumps("stiffness", "N/m", &[], &[level]).text,
        findings::jumps("stiffness", "N/m", &[12.02], &[level, (1.6, None)]).text,
        findings::jumps("stiffness", "N/m", &[4.0, 12.02], &[level; 3]).text,
    ];
    section(&mut list, "Jumps of a function", all);
    let all = starts();
    let all = all
        .iter()
        .map(|(f, starts)| findings::of_starts(f, *starts).text);
    section(&mut list, "Starting points of a study", all);
    let all = [findings::not_predicted(("hammer 3", 12.0)).text];
    section(&mut list, "Validation records", all);
    let all = suggestions();
    section(&mut list, "Suggestions", all.iter().map(|s| shown(s)));
    let all = problem_errors();
    section(
        &mut list,
        "Errors of the library",
        all.iter().map(|e| shown(e)),
    );
    let formats = formats("src/cli", "say(");
    section(
        &mut list,
        "Notes and warnings of commands, with placeholders",
        formats,
    );
    let formats = formats_of_findings();
    section(&mut list, "Further findings, with placeholders", formats);
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../tests/snapshots");
    settings.set_prepend_module_to_snapshot(false);
    settings.bind(|| insta::assert_snapshot!("messages", list));
}

/// Every error in the sources is compared by some test, except for [`UNTESTED`].
#[test]
fn every_error_is_tested() {
    let texts = sources("tests").into_iter().filter(|file| !is_list(file));
    let tests: String = texts.map(|file| read(&file).replace("\\\n", "")).collect();
    let mut missing = Vec::new();
    let folders = ["src", "crates/kmcfit-core/src/builder"];
    for file in folders.iter().flat_map(|folder| sources(folder)) {
        for problem in problems(&read(&file)) {
            let is_tested = fragments(&problem)
                .iter()
                .all(|part| tests.contains(part.as_str()));
            let is_exempt = UNTESTED.contains(&problem.as_str());
            match (is_tested, is_exempt) {
                (true, false) | (false, true) => {}
                (false, false) => missing.push(format!("{}: {problem}", file.display())),
                (true, true) => missing.push(format!("tested now: {problem}")),
            }
        }
    }
    assert!(
        missing.is_empty(),
        "{} without a test:\n{}",
        missing.len(),
        missing.join("\n")
    );
}

/// Errors whose text no test compares: of the operating system, of damaged files, and of checks behind others.
const UNTESTED: [&str; 30] = [
    "a study on so many nodes does not fit into memory",
    "the stored parameters have no response",
    "no input is given",
    "invalid samples of the input",
    "the model cannot be written with this value",
    "a map, or a list of maps",
    "too little memory to start",
    "the file does not fit into memory",
    "the table is empty",
    "the result describes no run that can be used",
    "a run that was killed cannot be completed here",
    "the journal cannot be written to",
    "this is a symbolic link",
    "the file cannot be read",
    "this folder holds the results of another command",
    "this folder holds unfinished work",
    "this input would be replaced by a result",
    "this is a file; results need a folder",
    "this is a symbolic link: results would be written elsewhere",
    "the file cannot be read: {error}",
    "the times are not equally spaced: they drift",
    "the column cannot be projected onto this basis",
    "this constraint contradicts itself",
    "no feasible start was found",
    "a static force and the offsets of the sensors cannot both be estimated: only their sum is identifiable",
    "the grid cannot be chosen without samples",
    "the functions of a basis are linearly dependent on the grid",
    "the reference cannot be projected onto this basis",
    "samples lie outside the time span of the grid",
    "the {} of the base is not known",
];

fn section(list: &mut String, title: &str, messages: impl IntoIterator<Item = String>) {
    let _ = writeln!(list, "== {title}\n");
    for message in messages {
        let _ = writeln!(list, "{message}");
        if message.contains('\n') {
            list.push('\n');
        }
    }
    list.push('\n');
}

/// True for the list of this module.
fn is_list(file: &Path) -> bool {
    file.ends_with("messages.snap")
}

fn read(file: &Path) -> String {
    fs::read_to_string(root().join(file)).expect("a text file")
}

fn root() -> PathBuf {
    let mut folders = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors();
    let root = folders.find(|folder| folder.join("models").is_dir());
    root.expect("the repository").to_path_buf()
}

/// Files with code or snapshots below a folder, sorted.
fn sources(folder: &str) -> Vec<PathBuf> {
    let mut found = BTreeSet::new();
    let mut folders = vec![PathBuf::from(folder)];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root().join(&folder)).expect("a folder") {
            let path = folder.join(entry.expect("an entry").file_name());
            let extension = path.extension().and_then(|e| e.to_str());
            if root().join(&path).is_dir() {
                folders.push(path);
            } else if matches!(extension, Some("rs" | "snap")) {
                found.insert(path);
            }
        }
    }
    found.into_iter().collect()
}

/// The errors in all snapshots of the tests, inline and in files, each once, in the order of the problems.
fn asserted_errors() -> Vec<String> {
    let mut found = BTreeSet::new();
    for file in sources("tests") {
        if file.ends_with("messages.snap") {
            continue;
        }
        let text = fs::read_to_string(root().join(&file)).expect("a source");
        match file.extension().is_some_and(|e| e == "snap") {
            true => collect(&text, &mut found),
            false => inline_snapshots(&text)
                .iter()
                .for_each(|s| collect(s, &mut found)),
        }
    }
    let mut errors: Vec<String> = found.into_iter().collect();
    errors.sort_by(|a, b| (problem(a), a).cmp(&(problem(b), b)));
    errors
}

/// The inline snapshots of a source.
fn inline_snapshots(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(at) = rest.find("@\"").into_iter().chain(rest.find("@r")).min() {
        let begins = &rest[at + 1..];
        let raw = begins
            .strip_prefix('r')
            .map(|b| b.len() - b.trim_start_matches('#').len());
        let close = format!("\"{}", "#".repeat(raw.unwrap_or(0)));
        let Some(open) = begins.find('"').filter(|open| *open <= 4) else {
            rest = begins;
            continue;
        };
        let body = &begins[open + 1..];
        let is_end = |i: &usize| raw.is_some() || !body[..*i].ends_with('\\');
        let Some(end) = body.match_indices(&close).map(|(i, _)| i).find(is_end) else {
            break;
        };
        let snapshot = body[..end].replace("\\\"", "\"").replace("\\\\", "\\");
        found.push(snapshot);
        rest = &body[end..];
    }
    found
}

/// Adds the errors of a snapshot: the line with the problem and its details, without the excerpt of the source.
fn collect(snapshot: &str, found: &mut BTreeSet<String>) {
    let is_detail = |l: &str| {
        ["found:", "expected:", "hint:"]
            .iter()
            .any(|d| l.starts_with(d))
    };
    let is_excerpt = |l: &str| {
        l.trim_start_matches(|c: char| c.is_ascii_digit())
            .trim_start()
            .starts_with('|')
    };
    let lines = snapshot.lines().map(str::trim).filter(|l| !is_excerpt(l));
    let mut lines = lines.peekable();
    while let Some(line) = lines.next() {
        let mut message = line.to_owned();
        while let Some(next) = lines.next_if(|l| is_detail(l)) {
            message += &format!("\n  {next}");
        }
        if message.contains('\n') || message.starts_with("error: ") {
            let message = message.strip_prefix("error: ").unwrap_or(&message);
            found.insert(message.to_owned());
        }
    }
}

/// The problem of an error, behind its location and key.
fn problem(message: &str) -> &str {
    let first = message.lines().next().unwrap_or_default();
    let is_place = |part: &str| {
        !part.contains(' ')
            || part.contains(": row")
            || ["row ", "sample "]
                .iter()
                .any(|place| part.starts_with(place))
    };
    let mut rest = first;
    while let Some((_, behind)) = rest.split_once(": ").filter(|(place, _)| is_place(place)) {
        rest = behind;
    }
    rest
}

/// Texts of the problems in calls that make an [`InputError`](crate::error::InputError) or an error of the builder.
fn problems(source: &str) -> Vec<String> {
    let tested = source.find("#[cfg(test)]").unwrap_or(source.len());
    let code = source[..tested]
        .lines()
        .filter(|l| !l.trim_start().starts_with("//"));
    let code = code.collect::<Vec<_>>().join("\n");
    let calls = [
        "error_at(",
        "InputError::new(",
        "InputError::argument(",
        "InputError::line(",
        "InputError::file(",
        "InputError::after(",
        "BuildError::new(",
        ".refused(",
    ];
    let mut found = Vec::new();
    for call in calls {
        for (at, _) in code.match_indices(call) {
            let arguments = arguments(&code[at + call.len()..]);
            let literals = literals(arguments);
            found.extend(literals.last().filter(|text| text.contains(' ')).cloned());
        }
    }
    for (at, mark) in code.match_indices("let problem = \"") {
        let text = &code[at + mark.len() - 1..];
        found.extend(
            literals(&text[..text.find(";\n").unwrap_or(text.len())])
                .into_iter()
                .take(1),
        );
    }
    found
}

/// The text up to the bracket that closes a call.
fn arguments(text: &str) -> &str {
    let (mut depth, mut quoted, mut escaped) = (1, false, false);
    for (i, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            '"' => quoted = !quoted,
            '(' if !quoted => depth += 1,
            ')' if !quoted => {
                depth -= 1;
                if depth == 0 {
                    return &text[..i];
                }
            }
            _ => {}
        }
    }
    text
}

/// The string literals of an expression.
fn literals(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut rest = text;
    while let Some(open) = rest.find('"') {
        let body = &rest[open + 1..];
        let Some((end, _)) = body
            .match_indices('"')
            .find(|(i, _)| !body[..*i].ends_with('\\'))
        else {
            break;
        };
        let folded: Vec<&str> = body[..end].split("\\\n").map(str::trim_start).collect();
        found.push(folded.concat().replace("\\\"", "\""));
        rest = &body[end + 1..];
    }
    found
}

/// The parts of a format string between its placeholders.
fn fragments(text: &str) -> Vec<String> {
    let text = text.replace("{{", "\u{1}").replace("}}", "\u{2}");
    let parts = text.split('{').enumerate();
    let parts = parts.map(|(i, part)| match (i, part.split_once('}')) {
        (0, _) | (_, None) => part,
        (_, Some((_, after))) => after,
    });
    let whole = parts.map(|part| part.replace('\u{1}', "{").replace('\u{2}', "}"));
    whole.filter(|part| part.trim().len() > 2).collect()
}

/// Format strings in the calls of a function below a folder, each once.
fn formats(folder: &str, call: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for file in sources(folder)
        .iter()
        .filter(|file| !file.ends_with("message_list_tests.rs"))
    {
        let text = read(file);
        let tested = text.find("#[cfg(test)]").unwrap_or(text.len());
        let text = &text[..tested];
        for (at, _) in text.match_indices(call) {
            let literals = literals(arguments(&text[at + call.len()..]));
            found.extend(literals.into_iter().filter(|text| text.contains(' ')));
        }
    }
    found
}

/// Format strings of findings on identifiability and of automatic choices.
fn formats_of_findings() -> BTreeSet<String> {
    let mut found = formats("crates/kmcfit-core/src/identifiability", "format!(");
    found.extend(formats("src/config/build/grid", "format!("));
    found.extend(formats("src/report", "let text = format!("));
    found
}

fn data_warnings() -> Vec<DataWarning> {
    let text = |t: &str| t.to_owned();
    samples![
        DataWarning::UnitDiffersFromFile { .. } => DataWarning::UnitDiffersFromFile {
            column: text("y"), used: text("mm"), stated: text("m"),
        },
        DataWarning::UnitDiffersFromName { .. } => DataWarning::UnitDiffersFromName {
            column: text("y_mm"), used: text("m"), stated: text("mm"),
        },
        DataWarning::UnknownUnit { .. } => DataWarning::UnknownUnit {
            column: text("y"), stated: text("furlong"), quantity: "displacement", used: text("m"),
        },
        DataWarning::UnitAssumed { .. } => DataWarning::UnitAssumed {
            column: text("y"), quantity: text("base_acceleration"), unit: text("m/s²"),
        },
        DataWarning::UnitOfNameUnused { .. } => DataWarning::UnitOfNameUnused {
            column: text("y_mm"), name: text("displacement"), used: text("m"), stated: text("mm"),
        },
        DataWarning::SigmaUnitDiffers { .. } => DataWarning::SigmaUnitDiffers {
            column: text("s"), used: text("mm"), stated: text("m"),
        },
        DataWarning::NearlyEqualTimes => DataWarning::NearlyEqualTimes,
        DataWarning::SuspiciousFactor { .. } => DataWarning::SuspiciousFactor {
            quantity: text("the velocity"), ratio: 998.7, factor: "1000 (mm and m)",
        },
        DataWarning::ImplausibleMagnitudes { .. } => DataWarning::ImplausibleMagnitudes {
            magnitudes: text("4 m at 0.002 Hz"),
            reading: Some(text("the times read as ms and the displacement read as mm give 2 Hz and 4 mm")),
        },
        DataWarning::ImplausibleMagnitudes { .. } => DataWarning::ImplausibleMagnitudes {
            magnitudes: text("900 g at 10 Hz"), reading: None,
        },
        DataWarning::MainsHum { .. } => DataWarning::MainsHum {
            channel: "acceleration", frequency: 0.05, unit: text("ms"),
        },
        DataWarning::SuspiciousMass { .. } => DataWarning::SuspiciousMass {
            channel: "acceleration", implied: 4503.2, ratio: 1000.7, factor: "the factor 1000 between m and mm",
        },
        DataWarning::OppositeSign { .. } => DataWarning::OppositeSign {
            high: "acceleration", low: "displacement",
        },
        DataWarning::TwoModes { .. } => DataWarning::TwoModes { channel: "acceleration", frequencies: [4.2, 7.31] },
        DataWarning::AtRest { .. } => DataWarning::AtRest { channel: "displacement", start: 1.25 },
        DataWarning::Outliers { .. } => DataWarning::Outliers {
            channel: "displacement", samples: 1, first_value: -9999.0, first_time: 4.5, unit: text("mm"), has_sigma: true,
        },
        DataWarning::Outliers { .. } => DataWarning::Outliers {
            channel: "displacement", samples: 5, first_value: -9999.0, first_time: 4.5, unit: text("mm"), has_sigma: false,
        },
        DataWarning::Saturation { .. } => DataWarning::Saturation {
            channel: text("acceleration"), samples: 12, level: 49.03, unit: text("m/s^2"), is_input: false,
        },
        DataWarning::Saturation { .. } => DataWarning::Saturation {
            channel: text("force"), samples: 12, level: 50.0, unit: text("N"), is_input: true,
        },
        DataWarning::Dropouts { .. } => DataWarning::Dropouts {
            channel: text("acceleration"), samples: 24, first: [1.25, 1.37], is_input: false,
        },
        DataWarning::Dropouts { .. } => DataWarning::Dropouts {
            channel: text("force"), samples: 24, first: [1.25, 1.37], is_input: true,
        },
        DataWarning::Spikes { .. } => DataWarning::Spikes {
            channel: text("acceleration"), samples: 1, first: 1.25, is_input: false,
        },
        DataWarning::Spikes { .. } => DataWarning::Spikes {
            channel: text("force"), samples: 3, first: 1.25, is_input: true,
        },
        DataWarning::InputGaps { .. } => DataWarning::InputGaps {
            channel: text("force"), count: 1, longest: [1.25, 1.37],
        },
        DataWarning::InputGaps { .. } => DataWarning::InputGaps {
            channel: text("base acceleration"), count: 2, longest: [1.25, 1.37],
        },
    ]
}

fn data_facts() -> Vec<DataFact> {
    let channel = || "acceleration".to_owned();
    let unit = || "g".to_owned();
    let gap = GapPlace {
        from: 1.25,
        to: 1.37,
        samples: 11,
    };
    samples![
        DataFact::RepeatedTimes { .. } => DataFact::RepeatedTimes {
            count: 1, lines: vec![14], action: DataAction::Merged,
        },
        DataFact::RepeatedTimes { .. } => DataFact::RepeatedTimes {
            count: 12, lines: (14..26).collect(), action: DataAction::First,
        },
        DataFact::RepeatedTimes { .. } => DataFact::RepeatedTimes {
            count: 2, lines: vec![14, 20], action: DataAction::Mean,
        },
        DataFact::Gaps { .. } => DataFact::Gaps {
            channel: channel(), count: 1, places: vec![gap], action: DataAction::Missing,
        },
        DataFact::Gaps { .. } => DataFact::Gaps {
            channel: "force".into(), count: 4, places: vec![gap; 4], action: DataAction::Interpolated,
        },
        DataFact::Dropouts { .. } => DataFact::Dropouts {
            channel: channel(), count: 24, places: vec![[1.25, 1.37]], action: DataAction::Excluded,
        },
        DataFact::Spikes { .. } => DataFact::Spikes {
            channel: channel(), count: 2, places: vec![1.25, 1.37], action: DataAction::Used,
        },
        DataFact::Saturation { .. } => DataFact::Saturation {
            channel: channel(), count: 12, level: 5.0, unit: unit(), action: DataAction::Excluded,
        },
        DataFact::Quantisation { .. } => DataFact::Quantisation {
            channel: channel(), step: 0.01, unit: unit(), share: 0.02, action: DataAction::AddedToSigma,
        },
        DataFact::Quantisation { .. } => DataFact::Quantisation {
            channel: channel(), step: 0.01, unit: unit(), share: 0.02, action: DataAction::LeastSigma,
        },
        DataFact::Delay { .. } => DataFact::Delay {
            channel: channel(), seconds: -0.0125, action: DataAction::Shifted,
        },
    ]
}

fn grid_notices() -> Vec<GridNotice> {
    samples![
        GridNotice::GridRefined { .. } => GridNotice::GridRefined { from: 1001, nodes: 3001, error: 0.0512 },
        GridNotice::GridLimited { .. } => GridNotice::GridLimited { nodes: 257_024, error: 0.42 },
    ]
}

fn notices() -> Vec<BuildNotice> {
    let key = || "constraints[0]".to_owned();
    samples![
        BuildNotice::NothingToFit => BuildNotice::NothingToFit,
        BuildNotice::AlwaysHolds { .. } => BuildNotice::AlwaysHolds { key: key() },
        BuildNotice::Uninformative { .. } => BuildNotice::Uninformative { key: key(), what: "a monotone mass" },
        BuildNotice::NoRoughness { .. } => BuildNotice::NoRoughness {
            key: "functions.mass.penalty".into(), basis: "constant",
        },
        BuildNotice::Measurement { .. } => BuildNotice::Measurement { remark: "(a note of the state estimation)".into() },
        BuildNotice::MassMayVanish { .. } => BuildNotice::MassMayVanish { key: "functions.mass.min".into() },
        BuildNotice::StartMoved { .. } => BuildNotice::StartMoved { constraint: "mass >= 0.05".into() },
    ]
}

fn statuses() -> Vec<Status> {
    samples![
        Status::Converged => Status::Converged,
        Status::Completed => Status::Completed,
        Status::MaxIterations => Status::MaxIterations,
        Status::TimeLimit => Status::TimeLimit,
        Status::Stalled => Status::Stalled,
        Status::Interrupted => Status::Interrupted,
        Status::Infeasible => Status::Infeasible,
        Status::Failed => Status::Failed,
    ]
}

fn conic_statuses() -> Vec<ConicStatus> {
    samples![
        ConicStatus::Solved => ConicStatus::Solved,
        ConicStatus::Almost => ConicStatus::Almost,
        ConicStatus::Infeasible => ConicStatus::Infeasible,
        ConicStatus::Stalled => ConicStatus::Stalled,
    ]
}

fn simulation_errors() -> Vec<SimulationError> {
    let causes = samples![
        Cause::Mass => Cause::Mass,
        Cause::Overflow => Cause::Overflow,
        Cause::CostOverflow => Cause::CostOverflow,
    ];
    let error = |cause| SimulationError {
        cause,
        node: 3,
        time: 0.3,
        value: -0.25,
    };
    causes.into_iter().map(error).collect()
}

fn condition_failures() -> Vec<ConditionFailure> {
    samples![
        ConditionFailure::Violation(_) => ConditionFailure::Violation(1e-4),
        ConditionFailure::Complementarity(_) => ConditionFailure::Complementarity(1e-4),
        ConditionFailure::Stationarity(_) => ConditionFailure::Stationarity(1e-4),
    ]
}

fn missing_measurements() -> Vec<MissingMeasurement> {
    samples![
        MissingMeasurement::KnownSensors => MissingMeasurement::KnownSensors,
        MissingMeasurement::Oscillation => MissingMeasurement::Oscillation,
        MissingMeasurement::FilteredDrive => MissingMeasurement::FilteredDrive,
        MissingMeasurement::Samples => MissingMeasurement::Samples,
        MissingMeasurement::Motion => MissingMeasurement::Motion,
    ]
}

fn reasons() -> Vec<Reason> {
    use kmcfit_core::internals::solvers::BoundedValue;
    let bounded = |value, limit| Some(BoundedValue { value, limit });
    let met = || {
        Box::new(Reason::SmallChange(BoundedValue {
            value: 1e-11,
            limit: 1e-10,
        }))
    };
    let error = simulation_errors()[0];
    let mut all = samples![
        Reason::Ratios { .. } => Reason::Ratios { cost: bounded(2e-13, 1e-12), gradient: bounded(3e-9, 1e-8) },
        Reason::SmallChange(_) => Reason::SmallChange(BoundedValue { value: 1e-11, limit: 1e-10 }),
        Reason::SmallDecrease { .. } => Reason::SmallDecrease { decrease: 1e-13, change: 1e-9 },
        Reason::IterationLimit(_) => Reason::IterationLimit(50),
        Reason::AllIterations(_) => Reason::AllIterations(1000),
        Reason::TimeLimit(_) => Reason::TimeLimit(Duration::from_secs(60)),
        Reason::Interrupted => Reason::Interrupted,
        Reason::NoParameters => Reason::NoParameters,
        Reason::ZeroSamples => Reason::ZeroSamples,
        Reason::ExactStart => Reason::ExactStart,
        Reason::Overflow => Reason::Overflow,
        Reason::ZeroCost => Reason::ZeroCost,
        Reason::NegligibleResiduals => Reason::NegligibleResiduals,
        Reason::NoPredictedDecrease => Reason::NoPredictedDecrease,
        Reason::NoPredictedChange(_) => Reason::NoPredictedChange(1e-12),
        Reason::NoLowerGaussNewtonStep => Reason::NoLowerGaussNewtonStep,
        Reason::NoLowerTrial(_) => Reason::NoLowerTrial(50),
        Reason::NoLowerLineStep => Reason::NoLowerLineStep,
        Reason::ZeroProjectedGradient => Reason::ZeroProjectedGradient,
        Reason::NoDescentToProjection => Reason::NoDescentToProjection,
        Reason::NoLowerStepToProjection => Reason::NoLowerStepToProjection,
        Reason::Program(_) => Reason::Program(ConicStatus::Stalled),
        Reason::EquationError { .. } => Reason::EquationError { program: None, has_mass: true },
        Reason::EquationError { .. } => Reason::EquationError { program: None, has_mass: false },
        Reason::NoResponse(_) => Reason::NoResponse(error),
        Reason::NoFeasibleResponse(_) => Reason::NoFeasibleResponse(error),
        Reason::UnsupportedRecord(_) => Reason::UnsupportedRecord(UnsupportedRecord {
            experiment: 0, name: "free decay".into(), reason: MissingMeasurement::Samples,
        }),
        Reason::NoMinimum { .. } => Reason::NoMinimum { met: met(), failure: None },
    ];
    let failures = condition_failures().into_iter();
    all.extend(failures.map(|failure| Reason::NoMinimum {
        met: met(),
        failure: Some(failure),
    }));
    all.extend(conic_statuses().into_iter().map(Reason::Program));
    let solved = conic_statuses().into_iter();
    all.extend(solved.map(|p| Reason::EquationError {
        program: Some(p),
        has_mass: true,
    }));
    all.extend(simulation_errors().into_iter().map(Reason::NoResponse));
    let missing = missing_measurements().into_iter();
    all.extend(missing.map(|reason| {
        Reason::UnsupportedRecord(UnsupportedRecord {
            experiment: 0,
            name: "free decay".into(),
            reason,
        })
    }));
    all
}

fn coarse_basis(halves: Option<[f64; 2]>) -> CoarseBasis {
    CoarseBasis {
        index: 2,
        function: "stiffness".into(),
        unit: "N/m",
        p_value: 2.5e-4,
        change: 0.13,
        spans: vec![[3.0, 4.5]],
        knots: halves.is_none().then_some(21),
        halves,
    }
}

fn gap(other_counts: usize) -> GapAssessment {
    let statuses = samples![
        GapStatus::Identified => GapStatus::Identified,
        GapStatus::CarriedByBasis => GapStatus::CarriedByBasis,
        GapStatus::CarriedByPenalty => GapStatus::CarriedByPenalty,
        GapStatus::NotIdentified => GapStatus::NotIdentified,
    ];
    let functions = statuses.into_iter().enumerate();
    let functions = functions.map(|(index, status)| FunctionInGap {
        index,
        function: ["mass", "damping", "stiffness", "cubic stiffness"][index].into(),
        status,
    });
    GapAssessment {
        span: [12.0, 18.5],
        cycles: 5.996,
        ci95: Some([5.98, 6.012]),
        other_counts,
        functions: functions.collect(),
    }
}

fn width_notices() -> Vec<WidthNotice> {
    samples![
        WidthNotice::WidthReduced { .. } => WidthNotice::WidthReduced { from: 0.01, width: 2.5e-4, nodes: 48_001, shift: 0.062 },
        WidthNotice::WidthLimited { .. } => WidthNotice::WidthLimited { width: 5e-5, nodes: 480_001, shift: 0.34 },
    ]
}

fn fit_warnings() -> Vec<FitWarning> {
    let mut all = samples![
        FitWarning::BeyondSigma { .. } => FitWarning::BeyondSigma { times: 7.5 },
        FitWarning::CoarseSteps { .. } => FitWarning::CoarseSteps { times: 3.25 },
        FitWarning::PoorFit => FitWarning::PoorFit,
        FitWarning::Coloured { .. } => FitWarning::Coloured { covariance: ScoreCovariance::Model },
        FitWarning::Correlated => FitWarning::Correlated,
        FitWarning::CoarseBasis(_) => FitWarning::CoarseBasis(coarse_basis(None)),
        FitWarning::Gap(_) => FitWarning::Gap(gap(0)),
        FitWarning::DisturbedInput { .. } => FitWarning::DisturbedInput {
            experiment: "shaker".into(), input: InputQuantity::Force, sigma: 0.701, share: 0.052,
        },
        FitWarning::CoherentResiduals { .. } => FitWarning::CoherentResiduals {
            experiment: "shaker".into(), channel: "acceleration".into(), input: InputQuantity::Force, share: 0.123,
        },
        FitWarning::ContradictedInputSigma { .. } => FitWarning::ContradictedInputSigma {
            experiment: "shaker".into(), input: InputQuantity::BaseAcceleration, given: 0.1, likely: 0.048,
        },
        FitWarning::Aliased { .. } => FitWarning::Aliased { per_period: 2.2, frequency: 45.25 },
        FitWarning::MissingTerm(_) => FitWarning::MissingTerm(MissingTerm {
            term: CoefficientKind::QuadraticDamping, value: 0.352, t: 21.5, share: 0.031,
        }),
        FitWarning::TimeOrAmplitude(_) => FitWarning::TimeOrAmplitude(rival(-3.2)),
        FitWarning::ResidualMean { .. } => FitWarning::ResidualMean {
            experiment: "shaker".into(), channel: "acceleration".into(), mean: 0.021, t: 12.3, share: 0.42, or_static_force: false,
        },
        FitWarning::ResidualMean { .. } => FitWarning::ResidualMean {
            experiment: "free decay".into(), channel: "displacement".into(), mean: -3e-4, t: -25.1, share: -0.81, or_static_force: true,
        },
        FitWarning::FrictionWidth { .. } => FitWarning::FrictionWidth {
            estimate: "damping".into(), shift: Some(-8.25), unit: "N s/m".into(), errors: 2.14, width: 0.01,
        },
        FitWarning::FrictionWidth { .. } => FitWarning::FrictionWidth {
            estimate: "stiffness".into(), shift: None, unit: String::new(), errors: 0.83, width: 0.01,
        },
        FitWarning::Negative { .. } => FitWarning::Negative { function: "stiffness".into() },
        FitWarning::NegligibleForce { .. } => FitWarning::NegligibleForce { experiment: "shaker".into() },
        FitWarning::SecondMode { .. } => FitWarning::SecondMode { experiment: "shaker".into(), frequencies: [3.98, 17.21] },
        FitWarning::ClassicalDisagrees(_) => FitWarning::ClassicalDisagrees(classical()),
        FitWarning::RecordError(_) => FitWarning::RecordError(record_errors()[0].clone()),
    ];
    all.extend(
        record_errors()
            .into_iter()
            .skip(1)
            .map(FitWarning::RecordError),
    );
    let halves = coarse_basis(Some([1520.0, 1498.5]));
    all.push(FitWarning::CoarseBasis(halves));
    all.push(FitWarning::Gap(gap(1)));
    let covariance = ScoreCovariance::Kernel;
    all.push(FitWarning::Coloured { covariance });
    all
}

fn classical() -> ClassicalEstimate {
    ClassicalEstimate {
        experiment: "shaker".into(),
        method: ClassicalMethod::LogarithmicDecrement,
        frequency: 3.982,
        frequency_interval: [3.979, 3.985],
        damping_ratio: Some(0.0251),
        damping_interval: Some([0.0243, 0.0259]),
        agrees: false,
    }
}

fn record_errors() -> Vec<RecordError> {
    let experiment = || "shaker".to_owned();
    samples![
        RecordError::Delay { .. } => RecordError::Delay { experiment: experiment(), delay: 0.0125, samples: 2.5 },
        RecordError::InputPulses { .. } => RecordError::InputPulses {
            experiment: experiment(), count: 2, time: 4.25, error: -3.5,
        },
        RecordError::Delay { .. } => RecordError::Delay { experiment: experiment(), delay: -0.0125, samples: -2.5 },
        RecordError::ClockDifference { .. } => RecordError::ClockDifference { experiment: experiment(), percent: 0.998 },
        RecordError::ClockDifference { .. } => RecordError::ClockDifference { experiment: experiment(), percent: -0.998 },
        RecordError::InputSign { .. } => RecordError::InputSign { experiment: experiment() },
        RecordError::ChannelFactor { .. } => RecordError::ChannelFactor {
            experiment: experiment(), channel: "acceleration".into(), factor: 1000.3, beside_others: true,
        },
        RecordError::ChannelFactor { .. } => RecordError::ChannelFactor {
            experiment: experiment(), channel: "displacement".into(), factor: 9.806, beside_others: false,
        },
    ]
}

fn verdict_reasons() -> Vec<VerdictReason> {
    let experiment = || "shaker".to_owned();
    let missing = MissingTerm {
        term: CoefficientKind::CubicStiffness,
        value: 0.352,
        t: 21.5,
        share: 0.031,
    };
    samples![
        VerdictReason::Failed { .. } => VerdictReason::Failed { status: Status::Infeasible },
        VerdictReason::NoSystem { .. } => VerdictReason::NoSystem { reason: Unidentified::Noise },
        VerdictReason::PoorFit { .. } => VerdictReason::PoorFit { fit_percent: 57.4 },
        VerdictReason::BeyondSigma { .. } => VerdictReason::BeyondSigma { times: 7.5 },
        VerdictReason::CoarseSteps { .. } => VerdictReason::CoarseSteps { times: 3.25 },
        VerdictReason::NotConverged { .. } => VerdictReason::NotConverged { status: Status::TimeLimit },
        VerdictReason::MissingTerm(_) => VerdictReason::MissingTerm(missing),
        VerdictReason::TimeOrAmplitude(_) => VerdictReason::TimeOrAmplitude(rival(2.9)),
        VerdictReason::TimeOrAmplitude(_) => VerdictReason::TimeOrAmplitude(rival(-52.0)),
        VerdictReason::ResidualMean { .. } => VerdictReason::ResidualMean {
            experiment: experiment(), channel: "displacement".into(),
        },
        VerdictReason::FrictionWidth { .. } => VerdictReason::FrictionWidth { estimate: "damping".into() },
        VerdictReason::SecondMode { .. } => VerdictReason::SecondMode { frequencies: [3.98, 17.21] },
        VerdictReason::Saturation { .. } => VerdictReason::Saturation { channel: "acceleration".into() },
        VerdictReason::FaultySamples { .. } => VerdictReason::FaultySamples {
            experiment: experiment(), channel: "acceleration".into(), fault: SampleFault::Dropouts,
        },
        VerdictReason::FaultySamples { .. } => VerdictReason::FaultySamples {
            experiment: experiment(), channel: "acceleration".into(), fault: SampleFault::Spikes,
        },
        VerdictReason::FaultySamples { .. } => VerdictReason::FaultySamples {
            experiment: experiment(), channel: "force".into(), fault: SampleFault::InputGaps,
        },
        VerdictReason::FaultySamples { .. } => VerdictReason::FaultySamples {
            experiment: experiment(), channel: "force".into(), fault: SampleFault::CoarseInput,
        },
        VerdictReason::DelayAtLimit { .. } => VerdictReason::DelayAtLimit {
            parameter: "delay of the force of shaker".into(),
        },
        VerdictReason::DisturbedInput { .. } => VerdictReason::DisturbedInput {
            experiment: experiment(), input: InputQuantity::Force,
        },
        VerdictReason::CoherentResiduals { .. } => VerdictReason::CoherentResiduals {
            channel: "acceleration".into(), input: InputQuantity::Force, share: 0.123,
        },
        VerdictReason::ContradictedInputSigma { .. } => VerdictReason::ContradictedInputSigma {
            experiment: experiment(), input: InputQuantity::Force,
        },
        VerdictReason::NegligibleForce { .. } => VerdictReason::NegligibleForce { experiment: experiment() },
        VerdictReason::CoarseBasis { .. } => VerdictReason::CoarseBasis { function: "stiffness".into() },
        VerdictReason::ColouredResiduals => VerdictReason::ColouredResiduals,
        VerdictReason::Gap { .. } => VerdictReason::Gap { span: [12.0, 18.5] },
        VerdictReason::Aliased { .. } => VerdictReason::Aliased { per_period: 2.2 },
        VerdictReason::Negative { .. } => VerdictReason::Negative { function: "stiffness".into() },
        VerdictReason::NotPredicted { .. } => VerdictReason::NotPredicted {
            experiment: experiment(), fit_percent: 71.3,
        },
        VerdictReason::NotIdentified { .. } => VerdictReason::NotIdentified {
            functions: vec!["mass".into(), "damping".into(), "stiffness".into()],
        },
        VerdictReason::RankDeficient { .. } => VerdictReason::RankDeficient {
            rank_bound: 1999, parameters: 6000,
        },
        VerdictReason::OnlyRatios { .. } => VerdictReason::OnlyRatios { fixed: vec!["mass".into()] },
        VerdictReason::OnlyRatios { .. } => VerdictReason::OnlyRatios { fixed: Vec::new() },
        VerdictReason::EquationError => VerdictReason::EquationError,
        VerdictReason::ImplausibleUnits(_) => VerdictReason::ImplausibleUnits(Implausible::NaturalFrequency { value: 0.002 }),
        VerdictReason::ImplausibleUnits(_) => VerdictReason::ImplausibleUnits(Implausible::Velocity { value: 48.0 }),
        VerdictReason::ImplausibleUnits(_) => VerdictReason::ImplausibleUnits(Implausible::Displacement { value: 12.0 }),
        VerdictReason::DoubtfulUnits => VerdictReason::DoubtfulUnits,
        VerdictReason::EquationResidual { .. } => VerdictReason::EquationResidual { share: 0.48 },
        VerdictReason::ClassicalDisagrees(_) => VerdictReason::ClassicalDisagrees(classical()),
        VerdictReason::RecordError(_) => VerdictReason::RecordError(record_errors()[0].clone()),
    ]
}

fn verdict_assumptions() -> Vec<VerdictAssumption> {
    let experiment = || "shaker".to_owned();
    samples![
        VerdictAssumption::Clock { .. } => VerdictAssumption::Clock { experiment: experiment() },
        VerdictAssumption::Unit { .. } => VerdictAssumption::Unit { experiment: experiment(), channel: "displacement".into() },
    ]
}

fn rival(bic_difference: f64) -> AmplitudeRival {
    AmplitudeRival {
        functions: vec!["stiffness".into(), "damping".into()],
        terms: vec![
            CoefficientKind::QuinticStiffness,
            CoefficientKind::CoulombFriction,
        ],
        bic_difference,
        indices: vec![1, 2],
    }
}

fn unidentified() -> Vec<Unidentified> {
    let error = simulation_errors()[1];
    samples![
        Unidentified::Failed => Unidentified::Failed,
        Unidentified::NoResponseOnHalfStep { .. } => Unidentified::NoResponseOnHalfStep { error },
        Unidentified::StepDependent => Unidentified::StepDependent,
        Unidentified::Unrelated => Unidentified::Unrelated,
        Unidentified::Noise => Unidentified::Noise,
    ]
}

fn whiteness() -> Vec<Whiteness> {
    let mut all = samples![
        WhitenessResult::White => WhitenessResult::White,
        WhitenessResult::CorrelatedOver(_) => WhitenessResult::CorrelatedOver(0.12),
        WhitenessResult::CorrelatedAt(_) => WhitenessResult::CorrelatedAt(0.02),
        WhitenessResult::Untested(_) => WhitenessResult::Untested(UntestedReason::FewSamples),
    ];
    let untested = samples![
        UntestedReason::FewSamples => UntestedReason::FewSamples,
        UntestedReason::FewLags => UntestedReason::FewLags,
        UntestedReason::NoResiduals => UntestedReason::NoResiduals,
    ];
    all.extend(untested.into_iter().map(WhitenessResult::Untested));
    let test = |verdict| Whiteness {
        statistic: 30.0,
        degrees_of_freedom: 20,
        p_value: 0.043,
        share_outside: 0.1,
        verdict,
    };
    all.into_iter().map(test).collect()
}

fn classifications() -> Vec<FunctionClassification> {
    let all = samples![
        Classification::Identified { .. } => Classification::Identified { relative: 0.04 },
        Classification::Conditional { .. } => Classification::Conditional { relative: 0.04, on: Condition::Smoothness },
        Classification::OnlyRatio(_) => Classification::OnlyRatio("k/m".into()),
        Classification::PartlyIdentified(_) => Classification::PartlyIdentified(vec![[0.0, 4.0]]),
        Classification::NotIdentified => Classification::NotIdentified,
        Classification::Fixed => Classification::Fixed,
    ];
    let of = |verdict| FunctionClassification {
        name: "stiffness".into(),
        verdict,
        sentence: String::new(),
        identified_range: None,
    };
    all.into_iter().map(of).collect()
}

fn conditions() -> Vec<Condition> {
    samples![
        Condition::Smoothness => Condition::Smoothness,
        Condition::Basis => Condition::Basis,
        Condition::Input => Condition::Input,
        Condition::NegligibleNoise => Condition::NegligibleNoise,
        Condition::Jumps => Condition::Jumps,
        Condition::Time => Condition::Time,
    ]
}

fn no_intervals() -> Vec<NoIntervals> {
    samples![
        NoIntervals::ManyParameters => NoIntervals::ManyParameters,
        NoIntervals::ManySamples => NoIntervals::ManySamples,
        NoIntervals::ScaleOverTime => NoIntervals::ScaleOverTime,
        NoIntervals::NoMinimum => NoIntervals::NoMinimum,
    ]
}

fn starts() -> Vec<(MultistartFinding, usize)> {
    let all = samples![
        MultistartFinding::NoMinimum => MultistartFinding::NoMinimum,
        MultistartFinding::Points { .. } => MultistartFinding::Points { ended: 8, different: 1, lowest: 1999.2 },
        MultistartFinding::Points { .. } => MultistartFinding::Points { ended: 7, different: 3, lowest: 1999.2 },
        MultistartFinding::Connected(_) => MultistartFinding::Connected(true),
        MultistartFinding::Connected(_) => MultistartFinding::Connected(false),
        MultistartFinding::Lower { .. } => MultistartFinding::Lower { cost: 1999.2, fit: 2400.0 },
        MultistartFinding::NotReached(_) => MultistartFinding::NotReached(1999.2),
    ];
    all.into_iter().map(|finding| (finding, 8)).collect()
}

fn patterns() -> Vec<ResidualPattern> {
    samples![
        ResidualPattern::Outliers { .. } => ResidualPattern::Outliers { samples: 1, first: 4.5 },
        ResidualPattern::Outliers { .. } => ResidualPattern::Outliers { samples: 5, first: 4.5 },
        ResidualPattern::Offset => ResidualPattern::Offset,
        ResidualPattern::Drift => ResidualPattern::Drift,
        ResidualPattern::Tone { .. } => ResidualPattern::Tone { frequency: 50.0, beside: 4.2 },
    ]
}

fn suspects() -> Vec<Suspect> {
    samples![
        Suspect::Input { .. } => Suspect::Input { is_base: true, start_is_given: true },
        Suspect::Input { .. } => Suspect::Input { is_base: false, start_is_given: false },
        Suspect::UnknownForce => Suspect::UnknownForce,
        Suspect::Functions => Suspect::Functions,
    ]
}

fn suggestions() -> Vec<Suggestion> {
    let channel = || "displacement".to_owned();
    let mut all = samples![
        Suggestion::MoreIterations => Suggestion::MoreIterations,
        Suggestion::MoreTime => Suggestion::MoreTime,
        Suggestion::Resume => Suggestion::Resume,
        Suggestion::AnotherMethod => Suggestion::AnotherMethod,
        Suggestion::AnotherStart => Suggestion::AnotherStart,
        Suggestion::FinerSteps { automatic: false } => Suggestion::FinerSteps { automatic: false },
        Suggestion::FinerSteps { automatic: true } => Suggestion::FinerSteps { automatic: true },
        Suggestion::LargerSigma { .. } => Suggestion::LargerSigma { times: 4.5, fit: 99.12 },
        Suggestion::NoiseLimited { .. } => Suggestion::NoiseLimited { channel: channel(), fit: 71.0 },
        Suggestion::StateInputSigma { .. } => Suggestion::StateInputSigma { input: "force".into(), sigma: 0.701 },
        Suggestion::OutliersLimited { .. } => Suggestion::OutliersLimited { channel: channel(), fit: 71.0 },
        Suggestion::AddTerm { .. } => Suggestion::AddTerm { term: CoefficientKind::CoulombFriction, start: 4.125 },
        Suggestion::EstimateOffset { .. } => Suggestion::EstimateOffset {
            channel: "acceleration".into(), experiment: "shaker".into(), or_static_force: false,
        },
        Suggestion::EstimateOffset { .. } => Suggestion::EstimateOffset {
            channel: channel(), experiment: "free decay".into(), or_static_force: true,
        },
        Suggestion::SecondAmplitude => Suggestion::SecondAmplitude,
        Suggestion::ScaleChannel { .. } => Suggestion::ScaleChannel { channel: "acceleration".into(), factor: 0.101_97 },
        Suggestion::ReverseInput { .. } => Suggestion::ReverseInput {
            experiment: "shaker".into(), channels: vec![channel(), "acceleration".into()],
        },
        Suggestion::EstimateDelay { .. } => Suggestion::EstimateDelay {
            experiment: "shaker".into(), channel: "force".into(), delay: -0.0125, held: None,
        },
        Suggestion::EstimateDelay { .. } => Suggestion::EstimateDelay {
            experiment: "shaker".into(), channel: channel(), delay: 0.0025, held: Some(true),
        },
        Suggestion::EstimateDelay { .. } => Suggestion::EstimateDelay {
            experiment: "shaker".into(), channel: channel(), delay: -0.0025, held: Some(false),
        },
        Suggestion::ScaleTimes { .. } => Suggestion::ScaleTimes { experiment: "shaker".into(), percent: -0.85 },
        Suggestion::NarrowFriction => Suggestion::NarrowFriction,
        Suggestion::FinerBasis { .. } => Suggestion::FinerBasis { function: "stiffness".into(), without_sigma: false },
        Suggestion::FinerBasis { .. } => Suggestion::FinerBasis { function: "stiffness".into(), without_sigma: true },
        Suggestion::Constant { .. } => Suggestion::Constant { function: "damping".into(), p_value: 0.62 },
        Suggestion::StudyUnidentifiable { .. } => Suggestion::StudyUnidentifiable {
            parameters: 6000, rank_bound: 1999, can_be_simpler: true,
        },
        Suggestion::StudyUnidentifiable { .. } => Suggestion::StudyUnidentifiable {
            parameters: 33, rank_bound: 32, can_be_simpler: false,
        },
        Suggestion::Pattern { .. } => Suggestion::Pattern {
            channel: channel(), has_sigma: false, pattern: ResidualPattern::Offset,
        },
        Suggestion::Mismatch { .. } => Suggestion::Mismatch {
            channel: Some((channel(), "shaker".into())), fit: 12.0, start_from_data: true, suspect: Suspect::Functions, absent: vec![], without_sigma: false,
        },
    ];
    all.extend(patterns().into_iter().map(|pattern| Suggestion::Pattern {
        channel: channel(),
        has_sigma: true,
        pattern,
    }));
    all.extend(suspects().into_iter().map(|suspect| Suggestion::Mismatch {
        channel: None,
        fit: 12.0,
        start_from_data: false,
        suspect,
        absent: vec!["cubic"],
        without_sigma: false,
    }));
    all
}

fn problem_errors() -> Vec<ProblemError> {
    samples![
        ProblemError::Nodes { .. } => ProblemError::Nodes { functions: 21, grid: 41 },
        ProblemError::Functions { .. } => ProblemError::Functions { found: 2, terms: 2 },
        ProblemError::Record { .. } => ProblemError::Record { name: "free decay".into(), reason: "(reason)" },
        ProblemError::Penalty { .. } => ProblemError::Penalty { function: 3 },
        ProblemError::Constraint { .. } => ProblemError::Constraint { name: "mass >= 0.05".into() },
    ]
}
