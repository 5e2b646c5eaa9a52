"""Arrays of all kinds, and invalid input."""

import subprocess
import sys

import numpy as np
import pytest

import kmcfit as km
from kmcfit import _kmcfit


def test_arrays_of_all_kinds_give_the_same_fit(record, fit):
    time, force, acceleration = record
    strided = np.empty((len(time), 3))
    strided[:, 1] = force
    frozen = acceleration.copy()
    frozen.setflags(write=False)
    before = [time.copy(), strided.copy(), frozen.copy()]
    found = km.Model(mass=2.4).fit(km.Experiment(time=list(time), force=strided[:, 1], acceleration=frozen))
    assert found.parameters == fit.parameters
    reversed_twice = np.ascontiguousarray(acceleration[::-1])[::-1]
    big = force.astype(">f8")
    found = km.Model(mass=2.4).fit(km.Experiment(time=time, force=big, acceleration=reversed_twice))
    assert found.parameters == fit.parameters
    for array, copy in zip([time, strided, frozen], before):
        assert array.tobytes() == copy.tobytes()


def test_single_precision_is_converted_exactly(record):
    time, force, acceleration = (values.astype(np.float32) for values in record)
    double = [values.astype(np.float64) for values in (time, force, acceleration)]
    model = km.Model(mass=2.4)
    single = model.fit(km.Experiment(time=time, force=force, acceleration=acceleration))
    assert single.parameters == model.fit(km.Experiment(time=double[0], force=double[1], acceleration=double[2])).parameters


def test_missing_samples_are_nan_masked_or_left_out(record):
    time, force, acceleration = record
    gap = slice(100, 110)
    with_nan = acceleration.copy()
    with_nan[gap] = np.nan
    masked = np.ma.array(acceleration, mask=np.isnan(with_nan))
    model = km.Model(mass=2.4)
    found = model.fit(km.Experiment(time=time, force=force, acceleration=with_nan))
    assert found.parameters == model.fit(km.Experiment(time=time, force=force, acceleration=masked)).parameters
    assert found.result["experiments"][0]["channels"][0]["samples"] == len(time) - 10
    # An input acts at all times.
    with_gap = force.copy()
    with_gap[3] = np.nan
    with pytest.raises(km.InputError) as caught:
        model.fit(km.Experiment(time=time, force=with_gap, acceleration=acceleration))
    assert "force" in str(caught.value)


def test_tables_of_pandas(record, fit):
    pandas = pytest.importorskip("pandas")
    time, force, acceleration = record
    table = pandas.DataFrame({"t": time, "F": force, "acceleration": acceleration})
    before = table.copy()
    found = km.Model(mass=2.4).fit(km.Experiment(table, time="t", force="F"))
    assert found.parameters == fit.parameters
    pandas.testing.assert_frame_equal(table, before)
    with pytest.raises(km.InputError, match="did you mean `F`|no such column"):
        km.Experiment(table, time="t", force="f")
    nullable = table.astype("Float64")
    assert km.Model(mass=2.4).fit(km.Experiment(nullable, time="t", force="F")).parameters == fit.parameters
    # 5 ms are a whole number of nanoseconds: times with a zone give the same seconds.
    nanoseconds = np.round(time * 1e9).astype(np.int64)
    reference = km.Model(mass=2.4).fit(km.Experiment(time=nanoseconds / 1e9, force=force, acceleration=acceleration))
    zoned = pandas.Series(pandas.to_datetime(nanoseconds, unit="ns", utc=True)).dt.tz_convert("Europe/Zurich")
    found = km.Model(mass=2.4).fit(km.Experiment(time=zoned, force=force, acceleration=acceleration))
    assert found.parameters == reference.parameters
    with pytest.raises(km.InputError, match="not real numbers"):
        km.Experiment(time=table["t"], acceleration=table["acceleration"].astype(object))


T = np.linspace(0.0, 1.0, 50)
Y = np.cos(20.0 * T)
COMPLEX = Y.astype(complex)

#: Call, place, and a part of the message.
WRONG = [
    (lambda: km.Experiment(time=T, displacement=Y[:-1]), "Experiment.displacement", "expected: 50 samples, as `time`"),
    (lambda: km.Experiment(time=T[::-1], displacement=Y), "Experiment.time", "do not increase"),
    (lambda: km.Experiment(time=np.where(T > 0.5, np.nan, T), displacement=Y), "Experiment.time", "nan at index 25"),
    (lambda: km.Experiment(time=T, displacement=COMPLEX), "Experiment.displacement", "hint: pass `values.real`"),
    (lambda: km.Experiment(time=T, displacement=Y.astype(object)), "Experiment.displacement", "dtype object"),
    (lambda: km.Experiment(time=T, displacement=Y.astype(str)), "Experiment.displacement", "not real numbers"),
    (lambda: km.Experiment(time=T, displacement=Y > 0), "Experiment.displacement", "dtype bool"),
    (lambda: km.Experiment(time=T, displacement=Y[:, np.newaxis]), "Experiment.displacement", "values.ravel()"),
    (lambda: km.Experiment(time=T, displacement=3.0), "Experiment.displacement", "shape ()"),
    (lambda: km.Experiment(time=T, displacement=[[1.0], [2.0, 3.0]]), "Experiment.displacement", "not an array"),
    (lambda: km.Experiment(time=[], displacement=[]), "Experiment.time", "0 samples"),
    (lambda: km.Experiment(displacement=Y), "Experiment.time", "no times"),
    (lambda: km.Experiment(time=T, force=Y), "Experiment", "no measured response"),
    (lambda: km.Experiment(time=T, displacment=Y), "Experiment", "did you mean `displacement`?"),
    (lambda: km.Experiment(time=T, displacement=Y, units={"displacment": "mm"}), "Experiment.units", "did you mean"),
    (lambda: km.Experiment(time=T, displacement=Y, initial=(1, 2, 3)), "Experiment.initial", "3 values"),
    (lambda: km.Experiment(time=T, displacement=Y, velocity=Y, sigma=0.1), "Experiment.sigma", "sigma for each of"),
    (lambda: km.Experiment({"t": T, "y": Y}, time="t", displacement="z"), "Experiment.displacement", "no such column"),
    (lambda: km.Model(mas=1.0), "Model", "did you mean `mass`?"),
    (lambda: km.Constant(strat=1.0), "Constant", "did you mean `start`?"),
    (lambda: km.Model(mass={"basis": "constant", "strat": 1.0}), "functions.mass", "did you mean `start`?"),
    (lambda: km.Model(mass=km.Constant(min="low")), "functions.mass.min", "found: text `low`"),
    (lambda: km.Model(fit={"methd": "gauss-newton"}), "fit", "did you mean `method`?"),
    (lambda: km.Model(mass=1.0).fit(), "Model.fit", "no experiment"),
    (lambda: km.Model(mass=1.0).fit(T, Y), "record 1", "km.Experiment(time=t"),
    (lambda: km.Model(mass=-1.0).fit(km.Experiment(time=T, displacement=Y)), "functions.mass.fixed", "positive"),
    (lambda: km.Experiment(time=T, displacement=np.where(T > 0.5, np.inf, Y)), "Experiment.displacement", "inf at index 25"),
    (lambda: km.Model(mass=1.0).fit(km.Experiment(time=T, displacement=Y), set={"fit.stp": 1}), "fit", "found: `stp`"),
    (lambda: km.fit_model("no-such-file.yaml"), "no-such-file.yaml", "no such file"),
    (lambda: km.open("no-such-folder"), "no-such-folder", "no such folder"),
    (lambda: km.Model.from_yaml("format: 1\nexperimnts: []\n"), "model.yaml", "did you mean `experiments`?"),
]


@pytest.mark.parametrize("case", range(len(WRONG)))
def test_invalid_input_is_an_exception_with_its_place(case):
    call, place, text = WRONG[case]
    with pytest.raises(km.InputError) as caught:
        call()
    error = caught.value
    assert place in error.where, error.where
    assert text in str(error), str(error)
    assert error.problem and isinstance(error, ValueError)


def test_a_panic_is_an_exception(data):
    raw = km.Model(mass=2.4).problem(data)._raw
    with pytest.raises(km.InternalError):
        raw.cost(b"12345678")
    assert len(raw.names()) > 0


def test_a_file_that_changed_is_refused(data, tmp_path, fit):
    fit.save(tmp_path / "run", report=False)
    (tmp_path / "run" / "result.json").write_text('{"format": 1')
    with pytest.raises(km.InputError, match="result.json"):
        km.open(tmp_path / "run")


def test_a_subinterpreter_is_refused():
    code = (
        "try:\n    import _interpreters as subs\nexcept ImportError:\n    import _xxsubinterpreters as subs\n"
        "import kmcfit\n"
        "inner = subs.create()\n"
        "program = 'try:\\n    import kmcfit\\nexcept ImportError as error:\\n    print(\"refused:\", error)'\n"
        "subs.run_string(inner, program)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert done.stdout.startswith("refused:") and "subinterpreter" in done.stdout, done.stdout + done.stderr


def test_errors_are_pickled():
    import pickle

    error = km.InputError("a problem", "here", "1", "2", "3")
    copy = pickle.loads(pickle.dumps(error))
    assert str(copy) == str(error) == "here: a problem\n  found: 1\n  expected: 2\n  hint: 3"
    assert "_kmcfit" in _kmcfit.__name__
