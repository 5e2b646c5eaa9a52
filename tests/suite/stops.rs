//! A request to end, as Ctrl-C makes it, while a fit is assessed.

use crate::common::repository;
use kmcfit::config::{BuildMode, ModelFile, build};
use kmcfit::fitting::fit_model;
use kmcfit::report::{CompletedFit, RequestedFiles};
use kmcfit_core::internals::assessment::VerdictLevel;
use kmcfit_core::internals::solvers::Observer;
use kmcfit_core::internals::threads::interruptible;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The estimates of an adequate fit remain; without the tests of a fit the verdict is not *Adequate*, and it names them.
#[test]
fn what_a_stop_leaves_out_is_named() {
    let file = ModelFile::read(repository("models/friction.yaml")).unwrap();
    let model = build(&file, BuildMode::Fit).unwrap();
    let assessed = |is_stopped: bool| {
        let found = fit_model(&model, &mut Observer::new(&mut |_| {})).unwrap();
        let flag = Arc::new(AtomicBool::new(is_stopped));
        let completed = interruptible(&flag, || CompletedFit::of(found));
        completed.fitted(RequestedFiles::default()).document()
    };
    let [whole, stopped] = [false, true].map(assessed);
    let [all, least] = [&whole, &stopped].map(|document| document.verdict.as_ref().unwrap());
    assert_eq!(all.level, VerdictLevel::Adequate);
    assert_eq!(least.level, VerdictLevel::Check);
    let texts: Vec<&str> = least
        .reasons
        .iter()
        .map(|reason| &*reason.sentence)
        .collect();
    assert_eq!(
        texts,
        [
            "stopped; not done: step-size check, tests of what the model lacks, confidence intervals, classical estimate"
        ]
    );
    assert_eq!(least.passed, "");
    let value = |name: &str| [&whole, &stopped].map(|d| d.estimates.get(name).unwrap().value);
    let [before, after] = value("mass");
    assert_eq!(before, after);
    assert!(stopped.estimates.get("mass").unwrap().ci95.is_none());
}
