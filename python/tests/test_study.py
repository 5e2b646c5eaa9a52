"""Studies of fits: typed results, the files of the program, and pages in notebooks."""

import json
import pickle
import re
import subprocess
import sys
from html.parser import HTMLParser

import numpy as np
import pytest
from conftest import MODELS, ROOT, program

import kmcfit as km

CANDIDATE = {"name": "release", "initial": {"displacement": 0.01, "velocity": 0.0}}


@pytest.fixture(scope="module")
def line(data):
    return km.Model(mass=2.4, stiffness=km.Polynomial(degree=1)).fit(data)


@pytest.fixture(scope="module")
def study(line):
    profiles = [{"function": "damping"}]
    return line.study(profiles=profiles, extremes=[0.5, 1.5], candidates=[CANDIDATE], threads=2)


def test_a_study_has_typed_results(study, line):
    assert study.status == "complete"
    sensitivity = study.sensitivity
    # Damping, two of the stiffness, initial state, offset: more directions than the stiffness has, all identified.
    assert sensitivity.rank == sensitivity.combinations == len(line.parameters)
    assert len(sensitivity.singular_values) == sensitivity.combinations and np.all(np.diff(sensitivity.singular_values) <= 0)
    assert study.classification["stiffness"] == "identified"
    # A nearly quadratic cost: the profile has the interval of the covariance.
    profile = next(iter(study.profiles.values()))
    assert profile.verdict == "identified"
    assert profile.interval == pytest.approx(line.estimates["damping"].ci95, rel=0.05)
    extremes = study.extremes["stiffness"]
    assert np.all(extremes.low <= line.stiffness(extremes.times)) and np.all(line.stiffness(extremes.times) <= extremes.high)
    assert [candidate.name for candidate in study.candidates] == ["release"] and study.candidates[0].d_ratio <= 1.0
    parts = {finding.part for finding in study.findings}
    assert {"profiles", "extremes", "candidates", "sensitivity"} <= parts
    assert all(finding.text in repr(study) for finding in study.findings if finding.part == "candidates")


def test_a_study_writes_the_files_of_the_program(study, line, tmp_path):
    line.save(tmp_path / "run", report=False)
    study.save(tmp_path / "study")
    changes = {
        "profiles": "[{function: damping}]",
        "extremes": "[0.5, 1.5]",
        "candidates": "[{name: release, initial: {displacement: 0.01, velocity: 0.0}}]",
    }
    words = [word for key, value in changes.items() for word in ("--set", f"study.{key}={value}")]
    done = program("study", tmp_path / "run" / "model.yaml", "--out", tmp_path / "program", *words)
    assert done.returncode == 0, done.stderr

    def files(folder):
        return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}

    assert files(tmp_path / "study") == files(tmp_path / "program")
    by_program = json.loads((tmp_path / "program" / "study.json").read_text())
    assert by_program == study.result
    # A run that was saved, opened and pickled is studied as the fit is.
    copy = pickle.loads(pickle.dumps(km.open(tmp_path / "run")))
    short = dict(profiles=[], extremes=[1.0], candidates=[])
    assert copy.study(**short).result["extremes"] == line.study(**short).result["extremes"]
    assert pickle.loads(pickle.dumps(study)).result == study.result
    with pytest.raises(km.InputError, match="not empty"):
        study.save(tmp_path / "study")


def test_options_are_the_keys_of_the_model_file(line, record):
    with pytest.raises(km.InputError, match="did you mean `profiles`"):
        line.study(profile=[])
    with pytest.raises(km.InputError, match="invalid number of threads"):
        line.study(threads=0)
    with pytest.raises(km.InputError) as caught:
        line.study(extremes=[99.0])
    assert (caught.value.where, caught.value.found) == ("study.extremes[0]", "99")
    with pytest.raises(km.InputError, match="nothing to study"):
        time, force, acceleration = record
        known = dict(sigma=0.02, initial=(0.0, 0.0), sensors={"acceleration": {"offset": 0.0}})
        data = km.Experiment(time=time, force=force, acceleration=acceleration, **known)
        km.Model(mass=2.4, damping=1.0, stiffness=1500.0).study(data)


class Elements(HTMLParser):
    """Names of the elements, which are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.seen = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attributes):
        self.seen.append(tag)
        self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.seen.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_pages_in_notebooks_are_the_first_screen(line, study, data, tmp_path):
    line.save(tmp_path / "run")
    selection = km.compare({"line": line, "again": line})
    for shown in (line, km.open(tmp_path / "run"), study, selection):
        page = shown._repr_html_()
        elements = Elements(page).seen
        assert {"h1", "table"} <= set(elements)
        assert "script" not in elements and "id" not in re.findall(r"<figure[^>]*\b(id)=", page)
        # Every rule of the style is within the element.
        style = page.split("<style>")[1].split("</style>")[0]
        assert all(rule.strip().startswith(".kmcfit-page") for part in style.split("}")[:-1] for rule in part.split("{")[0].split(","))
    page = line._repr_html_()
    assert "Adequate" in page and "stiffness" in page and "<svg" in page
    line.save(tmp_path / "bare", report=False)
    assert "<table>" in km.open(tmp_path / "bare")._repr_html_()


def test_hostile_names_stay_text(record):
    time, force, acceleration = record
    name = "</style><script>alert(1)</script><img src=x onerror=alert(2)>\" ' &"
    data = km.Experiment(time=time, force=force, acceleration=acceleration, name=name)
    fit = km.Model(mass=2.4, title=name).fit(data)
    page = fit._repr_html_()
    assert "&lt;script&gt;" in page
    elements = Elements(page).seen
    assert "script" not in elements and "img" not in elements and elements.count("style") == 1


def test_a_study_of_a_file_is_that_of_the_program(tmp_path):
    """Bits of all analyses, of a model with many parameters that has a verdict of its own."""
    path = MODELS / "linear-mass.yaml"
    done = program("study", path, "--out", tmp_path / "program", "--set", "study.extremes=[12.5]")
    assert done.returncode == 0, done.stderr
    assert km.fit_model(path).study(extremes=[12.5]).result == json.loads((tmp_path / "program" / "study.json").read_text())


def test_ctrl_c_ends_a_study_after_the_finished_analyses():
    # 100000 further fits would take minutes.
    code = (
        "import os, signal, threading, warnings, kmcfit as km\n"
        f"fit = km.fit_model({str(MODELS / 'linear-mass.yaml')!r})\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # Ignored in what a shell starts in the background.
        "threading.Timer(1.0, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "with warnings.catch_warnings(record=True) as caught:\n"
        "    warnings.simplefilter('always')\n"
        "    study = fit.study(starts=100_000)\n"
        "print(study.status, study.sensitivity.rank, len(study.result['extremes']), len(caught))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["interrupted", "3", "0", "1"], done.stderr
