//! Runs of the program by an unprivileged user.

use crate::workbench::Workbench;
use std::process::Command;

/// Exit code and messages of the program, run in the bench by a user without rights, who may change what is there after
/// `prepare`, a shell command; `limits` are words before the program. `None` where this process may not change
/// its user. An administrator may write to every folder, and limits on processes do not hold for one.
pub fn run_unprivileged(
    bench: &Workbench,
    prepare: &str,
    limits: &[&str],
    arguments: &[&str],
) -> Option<(i32, String)> {
    let user = ["--reuid=65534", "--clear-groups"];
    let can = Command::new("setpriv")
        .args(user)
        .args(limits)
        .arg("true")
        .status();
    if !can.is_ok_and(|status| status.success()) {
        eprintln!("SKIPPED: this process may not change its user");
        return None;
    }
    let program = bench.path("kmcfit");
    std::fs::copy(env!("CARGO_BIN_EXE_kmcfit"), &program).expect("a copy");
    let line = format!("chmod -R a+rwX . && {prepare} && exec setpriv \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &line, "sh"])
        .args(user)
        .args(limits)
        .arg(program)
        .args(arguments)
        .current_dir(bench.path(""))
        .output()
        .expect("a shell");
    let code = output.status.code().expect("an exit code");
    Some((code, String::from_utf8_lossy(&output.stderr).into_owned()))
}
