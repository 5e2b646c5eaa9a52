//! Output folders that are not empty: files of the user, inputs, runs of other commands, links.

use crate::tree::{settled, tree};
#[cfg(target_os = "linux")]
use crate::unprivileged::run_unprivileged;
use crate::workbench::{MODEL, Workbench};

/// The program exits with code 2 and a message about this path, and changes no file.
fn refused(bench: &Workbench, arguments: &[&str], about: &str) -> String {
    let before = tree(&bench.path(""));
    let (code, stdout, stderr) = bench.run(arguments);
    assert_eq!((code, stdout.as_str()), (2, ""), "{arguments:?}: {stderr}");
    assert!(
        stderr.starts_with(&format!("error: {about}: ")),
        "{arguments:?}: {stderr}"
    );
    assert!(tree(&bench.path("")) == before, "{arguments:?}: {stderr}");
    stderr
}

/// A project folder as output folder: the measurements and drawings in it are the user's.
#[test]
fn a_project_folder_keeps_its_files() {
    let bench = Workbench::with_small_model();
    let model = MODEL.replace("data: samples.csv", "data: channels/paper.csv");
    bench.write("model.yaml", &model);
    bench.write("channels/paper.csv", &bench.read("samples.csv"));
    bench.write("channels/other.csv", "t_s,y_m\n0,1\n");
    bench.write("figures/my_drawing.svg", "<svg/>");
    let before = tree(&bench.path(""));
    bench.run_to(0, &["fit", "model.yaml", "--out", "."]);
    let after = tree(&bench.path(""));
    for (name, entry) in &before {
        assert!(after.get(name) == Some(entry), "{name}");
    }
    assert!(bench.path("figures/motion.svg").exists());
    // A second run replaces only the program's own files.
    bench.run_to(0, &["fit", "model.yaml", "--out", ".", "--no-report"]);
    let after = tree(&bench.path(""));
    for (name, entry) in &before {
        assert!(after.get(name) == Some(entry), "{name}");
    }
    assert!(!bench.path("figures/motion.svg").exists());
}

/// A file or folder in the place of a result is reported before the fit.
#[test]
fn files_in_the_way_are_refused_before_the_fit() {
    for name in [
        "result.json",
        "history.csv",
        "report.html",
        "kmcfit-manifest.json",
        "fit.journal",
        "fit.checkpoint",
        "figures/motion.svg",
        "channels/1-displacement.csv",
    ] {
        let bench = Workbench::with_small_model();
        bench.write(&format!("run/{name}"), "mine\n");
        let fit = ["fit", "model.yaml", "--out", "run"];
        refused(&bench, &fit, &format!("run/{name}"));
    }
    for name in ["history.csv/", "figures/motion.svg/", "fit.journal/"] {
        let bench = Workbench::with_small_model();
        bench.write(&format!("run/{name}mine.txt"), "mine\n");
        let about = format!("run/{}", name.trim_end_matches('/'));
        refused(&bench, &["fit", "model.yaml", "--out", "run"], &about);
    }
    let bench = Workbench::with_small_model();
    bench.write("run/figures", "mine\n");
    refused(
        &bench,
        &["fit", "model.yaml", "--out", "run"],
        "run/figures",
    );
}

/// A table of a run as the start of the next one would be replaced while it is an input.
#[test]
fn inputs_are_never_replaced() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    let start = "{data: run/functions.csv, column: mass_kg}";
    let model = MODEL.replace("start: 2.0", &format!("start: {start}"));
    bench.write("next.yaml", &model);
    let stderr = refused(
        &bench,
        &["fit", "next.yaml", "--out", "run"],
        "run/functions.csv",
    );
    assert!(stderr.contains("input"), "{stderr}");
    bench.run_to(0, &["fit", "next.yaml", "--out", "other"]);
}

/// An edited file of an older run belongs to the user.
#[test]
fn edited_results_are_refused() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    for name in ["history.csv", "figures/functions.svg", "result.json"] {
        let path = format!("run/{name}");
        let text = bench.read(&path);
        bench.write(&path, &text.replacen('1', "2", 1));
        let stderr = refused(&bench, &["fit", "model.yaml", "--out", "run"], &path);
        assert!(stderr.contains("changed since kmcfit wrote it"), "{stderr}");
        bench.write(&path, &text);
    }
    std::fs::remove_file(bench.path("run/history.csv")).expect("removed");
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
}

/// A folder holds the results of one command.
#[test]
fn the_results_of_another_command_are_refused() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    for arguments in [
        &["compare", "model.yaml", "--out", "run"][..],
        &["compare", "run", "--out", "run"],
        &["predict", "run", "--initial", "1,0", "--out", "run"],
        &["check", "model.yaml", "--gradient", "--out", "run"],
        &["study", "model.yaml", "--out", "run"],
        &["demo", "--out", "run"],
    ] {
        let stderr = refused(&bench, arguments, "--out");
        assert!(stderr.contains("results of `kmcfit fit`"), "{stderr}");
    }
}

/// Another command does not discard a killed fit.
#[test]
fn unfinished_work_of_another_command_is_refused() {
    let bench = Workbench::with_small_model();
    let fit = ["fit", "model.yaml", "--out", "run"];
    bench.run_to(0, &[&fit[..], &["--set", "fit.stop.iterations=4"]].concat());
    let journal = r#"{"format":2,"version":"","command":"fit","inputs":["model.yaml"],"figures":true,"checkpoint":null,"sources":[]}"#;
    let heading = serde_json::from_str(journal).expect("a heading");
    let text = kmcfit::results::with_checksums(&heading, b"").expect("text");
    std::fs::create_dir(bench.path("killed")).expect("a folder");
    std::fs::write(bench.path("killed/fit.journal"), text).expect("room");
    for arguments in [
        &["study", "model.yaml", "--out", "killed"][..],
        &["compare", "model.yaml", "--out", "killed"],
        &["check", "model.yaml", "--gradient", "--out", "killed"],
    ] {
        let stderr = refused(&bench, arguments, "killed/fit.journal");
        assert!(stderr.contains("unfinished work"), "{stderr}");
    }
    bench.run_to(0, &["fit", "model.yaml", "--out", "killed"]);
}

/// Links below an output folder are not followed out of it.
#[test]
#[cfg(unix)]
fn links_inside_an_output_folder_are_refused() {
    use std::os::unix::fs::symlink;
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "elsewhere"]);
    std::fs::create_dir(bench.path("o")).expect("a folder");
    symlink(bench.path("elsewhere"), bench.path("o/model")).expect("a link");
    refused(&bench, &["compare", "model.yaml", "--out", "o"], "o/model");
    let bench = Workbench::with_small_model();
    for link in ["results", "models"] {
        bench.write("elsewhere/mine.txt", "mine");
        std::fs::create_dir(bench.path("demo")).expect("a folder");
        symlink(bench.path("elsewhere"), bench.path(&format!("demo/{link}"))).expect("a link");
        refused(&bench, &["demo", "--out", "demo"], &format!("demo/{link}"));
        std::fs::remove_dir_all(bench.path("demo")).expect("removed");
    }
}

/// A model of the demonstration that was edited, as its last line suggests, is not overwritten.
#[test]
fn an_edited_demonstration_is_refused() {
    let bench = Workbench::empty();
    bench.write("demo/models/physical.yaml", "mine\n");
    refused(
        &bench,
        &["demo", "--out", "demo"],
        "demo/models/physical.yaml",
    );
}

/// `simulate` replaces its own tables only.
#[test]
fn simulate_replaces_its_own_tables_only() {
    let bench = Workbench::with_small_model();
    let simulate = ["simulate", "model.yaml", "--out", "made.csv"];
    bench.write("made.csv", "t_s,y_m\n0,1\n");
    refused(&bench, &simulate, "--out");
    std::fs::remove_file(bench.path("made.csv")).expect("removed");
    bench.write("made.csv.json", "{\"mine\": 1}\n");
    refused(&bench, &simulate, "--out");
    std::fs::remove_file(bench.path("made.csv.json")).expect("removed");
    bench.run_to(0, &simulate);
    bench.run_to(0, &[&simulate[..], &["--nodes", "11"]].concat());
    let text = bench.read("made.csv");
    bench.write("made.csv", &format!("{text}2.1,0\n"));
    refused(&bench, &simulate, "--out");
}

/// A rejected command creates no folder.
#[test]
fn a_refused_command_leaves_no_folder() {
    let bench = Workbench::with_small_model();
    bench.write("side/model/result.json", "mine\n");
    bench.write("other.yaml", MODEL);
    let compare = ["compare", "other.yaml", "model.yaml", "--out", "side"];
    refused(&bench, &compare, "side/model/result.json");
}

/// The next run removes temporary folders of a killed run; folders with similar names stay.
#[test]
fn leftovers_of_killed_runs_are_removed() {
    let bench = Workbench::with_small_model();
    bench.write("run/.kmcfit-notes/mine.txt", "mine");
    bench.write("run/.kmcfit-file", "mine");
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    assert_eq!(bench.read("run/.kmcfit-notes/mine.txt"), "mine");
    assert_eq!(bench.read("run/.kmcfit-file"), "mine");
    let whole = tree(&bench.path("run"));
    let settled = settled(&whole);
    assert_eq!(whole.len(), settled.len() + 3, "{:?}", whole.keys());
}

/// A subfolder that cannot be written to is reported before the fit.
#[test]
#[cfg(target_os = "linux")]
fn a_read_only_folder_below_is_refused_before_the_fit() {
    let bench = Workbench::with_small_model();
    bench.run_to(0, &["fit", "model.yaml", "--out", "run"]);
    let fit = ["fit", "model.yaml", "--out", "run"];
    let Some((code, stderr)) = run_unprivileged(&bench, "chmod 555 run/figures", &[], &fit) else {
        return;
    };
    assert_eq!(code, 2, "{stderr}");
    assert!(stderr.starts_with("error: --out: "), "{stderr}");
    assert!(stderr.contains("run/figures"), "{stderr}");
    assert!(!bench.path("run/fit.journal").exists());
}

/// A file in the place of an output folder is reported.
#[test]
#[cfg(unix)]
fn other_things_in_the_place_of_the_folder_are_named() {
    let bench = Workbench::with_small_model();
    std::os::unix::fs::symlink("nowhere", bench.path("link")).expect("a link");
    bench.write("file", "mine");
    for (out, what) in [
        ("link/run", "a link"),
        ("link", "a link"),
        ("file", "a file"),
        ("/dev/null", "a special file"),
        #[cfg(target_os = "linux")]
        ("/proc/kmcfit", "/proc takes no new folders"),
    ] {
        let stderr = refused(&bench, &["fit", "model.yaml", "--out", out], "--out");
        assert!(stderr.contains(what), "{stderr}");
        assert!(!stderr.contains("os error"), "{stderr}");
    }
}

/// A study that was killed over the results of an older one is unfinished work as well; a finished one is replaced.
#[test]
fn a_study_killed_over_older_results_is_replaced_with_a_note() {
    for command in ["study", "compare"] {
        let bench = Workbench::with_small_model();
        let run = || bench.run(&[command, "model.yaml", "--out", "twice"]);
        let is_said = |stderr: &str| stderr.contains("Discarding the unfinished");
        for _ in 0..2 {
            let (code, _, stderr) = run();
            assert!(code == 0 || code == 3, "{stderr}");
            assert!(!is_said(&stderr), "{stderr}");
        }
        // Killed after its first line.
        let journal = format!("twice/{command}.journal");
        let text = bench.read(&journal);
        let heading = text.lines().next().expect("a heading");
        bench.write(&journal, &format!("{heading}\n"));
        bench.write("other.yaml", &bench.read("model.yaml"));
        refused(&bench, &[command, "other.yaml", "--out", "twice"], &journal);
        let (_, _, stderr) = run();
        assert!(is_said(&stderr), "{stderr}");
    }
}

/// Unfinished work on another model is not discarded; on the same model it is, with a note.
#[test]
fn unfinished_work_on_another_model_is_refused() {
    for (command, journal) in [("fit", "fit"), ("study", "study"), ("compare", "compare")] {
        let bench = Workbench::with_small_model();
        bench.write("other.yaml", MODEL);
        let text = format!(
            r#"{{"format":2,"version":"","command":"{command}","inputs":["other.yaml"],"figures":true,"checkpoint":null,"sources":[]}}"#
        );
        let heading = serde_json::from_str(&text).expect("a heading");
        let text = kmcfit::results::with_checksums(&heading, b"").expect("text");
        let journal = format!("killed/{journal}.journal");
        std::fs::create_dir(bench.path("killed")).expect("a folder");
        std::fs::write(bench.path(&journal), text).expect("room");
        let stderr = refused(
            &bench,
            &[command, "model.yaml", "--out", "killed"],
            &journal,
        );
        assert!(stderr.contains("other.yaml"), "{stderr}");
        let (code, _, stderr) = bench.run(&[command, "./other.yaml", "--out", "killed"]);
        assert!(code == 0 || code == 3, "{stderr}");
        assert!(stderr.contains("Discarding the unfinished"), "{stderr}");
    }
}
