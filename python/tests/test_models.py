"""The shipped models give the same bits as the program."""

import json

import pytest
from conftest import MODELS, ROOT, program

import kmcfit as km

#: Simulations.
NO_FITS = {"paper-device", "paper-experiments"}
NAMES = sorted(path.stem for path in MODELS.glob("*.yaml") if path.stem not in NO_FITS)


def files(folder):
    """The files of a run, without times of computing."""
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            found[path.relative_to(folder).as_posix()] = path.read_bytes()
    result = json.loads(found["result.json"])
    del result["seconds"], result["timings"]
    return {**found, "result.json": result}


@pytest.mark.parametrize("name", NAMES)
def test_a_model_file_gives_the_files_of_the_program(name, tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    model = f"models/{name}.yaml"
    done = program("fit", model, "--out", tmp_path / "program", "--no-report")
    assert done.returncode == 0, done.stderr
    km.fit_model(model).save(tmp_path / "package", report=False)
    expected, found = files(tmp_path / "program"), files(tmp_path / "package")
    assert sorted(found) == sorted(expected)
    for file in expected:
        assert found[file] == expected[file], file


@pytest.mark.parametrize("path", sorted(MODELS.glob("*.yaml")), ids=lambda path: path.stem)
def test_a_model_is_written_and_read_again(path):
    model = km.Model.from_yaml(path)
    text = model.to_yaml()
    again = km.Model.from_yaml(text)
    assert again._spec == model._spec
    assert again.to_yaml() == text


def test_a_model_of_yaml_gives_the_bits_of_its_file(monkeypatch):
    monkeypatch.chdir(ROOT)
    path = "models/camera.yaml"
    assert km.Model.from_yaml(path).fit().parameters == km.fit_model(path).parameters


def test_arrays_give_the_bits_of_the_file(monkeypatch):
    """The paper's record as arrays, with the integral cost and the nodal functions of the paper."""
    monkeypatch.chdir(ROOT)
    table = km.read("data/paper.csv")
    data = km.Experiment(table, time="t_s", displacement="y_m", sigma=None, initial=(3.3, 1.0), name="free decay")
    model = km.Model(
        mass=km.Nodal(start=2.0, min="none"),
        damping=km.Nodal(start=1.0),
        stiffness=km.Nodal(start=1.0),
        grid={"nodes": 2000, "method": "midpoint"},
        fit={"method": "steepest-descent", "gradient": "continuous", "stop": {"iterations": 20}},
    )
    expected = km.fit_model("models/paper.yaml", set={"fit.stop.iterations": 20})
    found = model.fit(data)
    assert found.parameters == expected.parameters and found.cost == expected.cost


def test_the_program_runs_inside_the_package():
    done = program("explain", "fit.method")
    assert done.returncode == 0 and "method" in done.stdout
    assert program("fit", "no-such.yaml").returncode == 2
    assert program("fti").returncode == 2
    assert km.__version__ in program("--version").stdout
