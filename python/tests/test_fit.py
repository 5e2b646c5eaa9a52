"""Fits of arrays: estimates, curves, files."""

import json
import os
import pickle
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import MODELS, oscillator, program

import kmcfit as km

#: Fits of the test of the memory.
COUNT = int(os.environ.get("KMCFIT_FITS", "150"))


def test_estimates_contain_the_true_system(fit):
    # The record is made with these values; 95 % intervals of one seed, three times as wide: a chance of 1e-8.
    for name, true in {"damping": 1.0, "stiffness": 1500.0, "natural_frequency": np.sqrt(1500 / 2.4) / (2 * np.pi)}.items():
        low, high = fit.estimates[name].ci95
        half = 0.5 * (high - low)
        assert abs(fit.estimates[name].value - true) < 3 * half, name
        assert half < 0.01 * true, name
    assert fit.status == "converged" and fit.verdict.level == "adequate"
    assert fit.estimates["mass"].status == "fixed"
    assert fit.estimates[0].quantity == fit.result["estimates"].__iter__().__next__()
    assert "natural_frequency" in repr(fit.estimates) and "<table>" in fit.estimates._repr_html_()
    assert "<svg" in fit._repr_html_()


def test_a_force_determines_an_unknown_mass(data, record):
    fit = km.Model().fit(data)
    low, high = fit.estimates["mass"].ci95
    # Made with 2.4 kg; as above.
    assert abs(fit.estimates["mass"].value - 2.4) < 1.5 * (high - low) < 0.1
    assert pickle.loads(pickle.dumps(km.Model())).fit(data).parameters == fit.parameters
    free = km.Experiment(time=record[0], acceleration=record[2])
    assert "unknown" in km.Model().to_yaml(free) and "unknown" not in km.Model().to_yaml(data)


def test_curves_are_the_columns_of_the_table(fit):
    table, stiffness = fit.functions, fit.stiffness
    assert stiffness.unit == "N/m"
    assert np.array_equal(stiffness(table["t_s"]), table["stiffness_N_per_m"])
    low, high = stiffness.band(1.0)
    assert low < stiffness(1.0) < high
    assert (low, high) == pytest.approx(fit.estimates["stiffness"].ci95, rel=1e-12)
    # A normal distribution: 0.6827 within one standard deviation, 1.96 for 95 %.
    narrow = fit.stiffness.band(1.0, 0.6826894921370859)
    assert (narrow[1] - narrow[0]) * 1.959963984540054 == pytest.approx(high - low, rel=1e-9)
    assert np.isnan(stiffness(99.0))
    with pytest.raises(AttributeError):
        fit.cubic_stiffness
    with pytest.raises(km.InputError, match="did you mean `stiffness`"):
        fit.curve("stifness")


def test_simulated_response_is_that_of_another_integrator(fit, record):
    time = record[0]
    force = 5.0 * np.cos(9.0 * time)
    found = fit.simulate(time=time, force=force, initial=(0.01, -0.2), channels="acceleration")
    values = fit.parameters
    linear = lambda t: np.interp(t, time, force)  # noqa: E731
    _, expected = oscillator(2.4, values["damping"], values["stiffness"], time, linear, (0.01, -0.2))
    at = np.interp(time, found["t_s"], found["acceleration_m_per_s2"])
    # Both are of order 4, with at least ten steps in 1/20 of a period: errors below 1e-6 of the peak, sampling of the table included.
    assert np.max(np.abs(at - expected)) < 2e-3 * np.max(np.abs(expected))
    free = fit.simulate(initial=(0.01, 0.0))
    assert free["displacement_m"][0] == 0.01


def test_a_saved_run_is_verified_opened_and_pickled(fit, data, tmp_path):
    fit.save(tmp_path / "run", report=False)
    done = program("verify", tmp_path / "run")
    assert done.returncode == 0, done.stdout + done.stderr
    opened = km.open(tmp_path / "run")
    copy = pickle.loads(pickle.dumps(opened))
    for other in (opened, copy, pickle.loads(pickle.dumps(fit))):
        assert other.estimates == fit.estimates and other.parameters == fit.parameters
        assert np.array_equal(other.covariance, fit.covariance)
        assert other.stiffness(1.0) == fit.stiffness(1.0)
    copy.save(tmp_path / "copy")
    assert km.open(tmp_path / "copy").result == opened.result
    with pytest.raises(km.InputError, match="not empty"):
        copy.save(tmp_path / "copy")
    # The same model as files gives the same bits.
    km.Model(mass=2.4).save(tmp_path / "model.yaml", data)
    again = km.fit_model(tmp_path / "model.yaml")
    assert again.parameters == fit.parameters and again.estimates == fit.estimates
    with pytest.raises(km.InputError, match="exists already"):
        km.Model(mass=2.4).save(tmp_path / "model.yaml", data)


def test_threads_give_the_same_bits(data, fit):
    found = []
    work = lambda: found.append(km.Model(mass=2.4).fit(data).parameters)  # noqa: E731
    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert found == [fit.parameters] * 4


#: Fits that would take hours: 10 million iterations. The records of the second are small: it runs in the main thread.
LONG = {
    "file": f"fit = km.fit_model({str(MODELS / 'paper.yaml')!r}, set={{'fit.stop.iterations': 10_000_000}})",
    "arrays": (
        "t = numpy.linspace(0.0, 10.0, 400)\n"
        "    data = km.Experiment(time=t, displacement=numpy.cos(t) * (1 - 0.02 * t), sigma=None, initial=(1.0, 0.0))\n"
        "    free = {name: km.Nodal(start=1.5) for name in ('mass', 'damping', 'stiffness')}\n"
        "    slow = {'method': 'steepest-descent', 'stop': {'iterations': 10_000_000}}\n"
        "    fit = km.Model(**free, fit=slow, grid={'nodes': 400, 'method': 'midpoint'}).fit(data)"
    ),
}


@pytest.mark.parametrize("kind", LONG)
def test_ctrl_c_ends_a_fit_at_its_best_point(kind):
    code = (
        "import os, signal, threading, warnings, numpy, kmcfit as km\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # Ignored in what a shell starts in the background.
        "threading.Timer(0.7, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "with warnings.catch_warnings(record=True) as caught:\n"
        "    warnings.simplefilter('always')\n"
        f"    {LONG[kind]}\n"
        "cost = fit.result['cost']\n"
        "print(fit.status, cost['final'] < cost['initial'], len(fit.history['cost']) > 0, len(caught))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["interrupted", "True", "True", "1"], done.stderr


def test_progress_is_called_after_each_iteration(data, fit):
    seen = []
    found = km.Model(mass=2.4).fit(data, progress=lambda iteration, cost: seen.append((iteration, cost)))
    assert found.parameters == fit.parameters and len(seen) >= len(fit.history["cost"])
    assert all(isinstance(iteration, int) and cost > 0.0 for iteration, cost in seen)

    def refuse(iteration, cost):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"):
        km.Model(mass=2.4).fit(data, progress=refuse)


def test_memory_stays_flat():
    resource = pytest.importorskip("resource")
    # A small fit of its own, so that 150 of them take seconds.
    time = np.linspace(0.0, 1.0, 101)
    force = 20.0 * np.sin(2 * np.pi * (2.0 * time + time**2))
    _, acceleration = oscillator(2.4, 1.0, 1500.0, time, lambda t: 20.0 * np.sin(2 * np.pi * (2.0 * t + t**2)))
    given = dict(sigma=0.02, noise={"acceleration": "white"}, initial=(0.0, 0.0), sensors={"acceleration": {"offset": 0.0}})
    data = km.Experiment(time=time, force=force, acceleration=acceleration, **given)
    model = km.Model(mass=2.4)

    def pages():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * resource.getpagesize()

    for _ in range(COUNT // 3):
        model.fit(data).estimates
    before = pages()
    for _ in range(COUNT):
        model.fit(data).estimates
    # A fit holds more than 0.1 MB (13 columns with intervals at 101 nodes or more, and the records): each kept would be 15 MB after 150.
    assert pages() - before < 0.02e6 * COUNT + 1e6


def test_comparison_prefers_the_constant(data, fit):
    line = km.Model(mass=2.4, stiffness=km.Polynomial(degree=1, start=[1500.0, 0.0])).fit(data)
    found = km.compare({"constant": fit, "line": line})
    assert [run["name"] for run in found.runs] == ["constant", "line"]
    assert found.runs[0]["bic_difference"] == 0.0 < found.runs[1]["bic_difference"]
    assert "constant" in repr(found) and found.html.startswith("<!DOCTYPE html>")
    assert found.result["format"] == 2 and json.dumps(found.result)
    with pytest.raises(km.InputError, match="too few fits"):
        km.compare({"constant": fit})


def test_extras(fit):
    pandas = pytest.importorskip("pandas")
    frame = fit.estimates.to_pandas()
    assert frame.loc["stiffness", "value"] == fit.estimates["stiffness"].value
    assert isinstance(fit.to_pandas(), pandas.DataFrame)


def test_figures_are_those_of_the_run(fit):
    assert "stiffness k (N/m)" in fit.plot().svg and "<svg" in fit.plot("residuals")._repr_html_()
    with pytest.raises(km.InputError, match="no such figure"):
        fit.plot("nothing")


def test_the_text_of_a_model_is_kept_for_the_next_record(record):
    time, force, acceleration = record
    records = [km.Experiment(time=time, force=force, acceleration=acceleration * factor) for factor in (1.0, 1.001)]
    records.append(km.Experiment(time=time, force=force, acceleration=acceleration, window={"min": 0.0, "max": 1.5}))
    model = km.Model(mass=2.4)
    estimates = [model.fit(data).parameters for data in records]
    assert estimates == [km.Model(mass=2.4).fit(data).parameters for data in records]
    assert estimates[0] != estimates[1] != estimates[2]


def test_what_is_preferred_is_added(record, fit, tmp_path):
    time, force, acceleration = record
    data = km.Experiment(time=time, force=force, acceleration=acceleration + 0.05 * time)
    plain, chosen = km.Model(mass=2.4).fit(data), km.Model(mass=2.4).fit(data, select=True)
    assert "selection" not in plain.result and plain.verdict.level != "adequate"
    (step,) = chosen.result["selection"]
    assert "drift" in step["added"] and step["gain"] > 6.0
    assert chosen.verdict.level == "adequate"
    # Made with 1500 N/m, as above.
    low, high = chosen.estimates["stiffness"].ci95
    assert abs(chosen.estimates["stiffness"].value - 1500.0) < 1.5 * (high - low)
    chosen.save(tmp_path / "run")
    assert km.open(tmp_path / "run").result["selection"] == chosen.result["selection"]
