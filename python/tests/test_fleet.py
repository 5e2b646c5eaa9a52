"""Fleets: rows equal those of the command line, for any executor, and after interruptions."""

import json
import os
import signal
from concurrent.futures import Future, ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from conftest import program

import kmcfit as km

MODEL = """\
format: 1
title: Decays
experiments:
  - data: records/r01.csv
    columns: {time: t_s, displacement: y_m}
    sigma: {displacement: estimate}
    initial: estimate
functions:
  mass:      {fixed: 1.0}
  damping:   {basis: constant, start: 0.1}
  stiffness: {basis: piecewise-linear, knots: 2, start: 4.0}
"""


def decay(i, samples=101):
    """Times and displacement of record `i`: m = 1 kg, c = 0.2 N s/m, an angular frequency that falls from record to record."""
    t = 0.1 * np.arange(samples)
    noise = 0.01 * np.random.default_rng(i).standard_normal(samples)
    return t, np.exp(-0.1 * t) * np.cos((2.2 - 0.01 * i) * t) + noise


def pairs(count):
    """Records as pairs of a name and arrays."""
    for i in range(count):
        t, y = decay(i)
        yield f"a{i:03}", {"time": t, "displacement": y}


def plain(rows):
    """Rows without their times."""
    return [{key: value for key, value in row.items() if key != "seconds"} for row in rows]


ARRAYS = km.Model(mass=1.0, damping=km.Constant(start=0.1), stiffness=km.PiecewiseLinear(knots=2, start=4.0))


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "records").mkdir()
    (tmp_path / "model.yaml").write_text(MODEL)
    for i in range(8):
        t, y = decay(i)
        lines = [f"{a:.1f},{b:.6f}" for a, b in zip(t, y)]
        (tmp_path / f"records/r{i:02}.csv").write_text("t_s,y_m\n" + "\n".join(lines) + "\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture(scope="module")
def expected():
    return plain(km.fit_many(ARRAYS, pairs(24)))


def test_the_folder_is_that_of_the_command_line(folder):
    rows = list(km.fit_many("model.yaml", "records/*.csv", out="own"))
    assert [row.record for row in rows] == [f"records/r{i:02}.csv" for i in range(8)]
    ended = program("fleet", "model.yaml", "records/*.csv", "--out", "other", cwd=folder)
    assert ended.returncode == 0, ended.stderr
    assert plain(km.read_fleet("own")) == plain(km.read_fleet("other")) == plain(rows)
    # The command finds nothing left to do, and the identity of its own fleet.
    before = (folder / "own/rows.jsonl").read_bytes()
    again = program("fleet", "model.yaml", "records/*.csv", "--out", "own", cwd=folder)
    assert again.returncode == 0 and (folder / "own/rows.jsonl").read_bytes() == before, again.stderr
    assert (folder / "own/fleet.json").read_text() == (folder / "other/fleet.json").read_text()
    assert (folder / "own/fleet.html").exists()
    table = (folder / "own/rows.csv").read_text().splitlines()
    assert len(table) == 9 and table[0].startswith("record,natural_frequency,")


def test_a_row_is_that_of_the_single_fit():
    (name, arrays), *_ = pairs(1)
    [row] = km.fit_many(ARRAYS, [(name, arrays)])
    single = ARRAYS.fit(km.Experiment(arrays)).result
    assert row.estimates == single["estimates"]
    assert row.verdict == single["verdict"]["level"] and row.error is None and row["seconds"] > 0.0
    assert "a000" in repr(row)


def test_all_forms_of_a_record_agree(folder):
    t, y = decay(1)
    file = "records/r01.csv"
    values = np.loadtxt(file, delimiter=",", skiprows=1)
    columns = {"t_s": values[:, 0], "y_m": values[:, 1]}
    content = (folder / file).read_bytes()
    records = [
        file,
        ("b.csv", content),
        ("c", columns),
        {"record": "d", "data": columns},
        {"record": "e", "file": file, "place": "span 3"},
    ]
    rows = list(km.fit_many("model.yaml", iter(records)))
    assert [row.record for row in rows] == [file, "b.csv", "c", "d", "e"]
    assert all(row.error is None for row in rows), rows
    assert all(row.estimates == rows[0].estimates for row in rows)
    experiment = km.Experiment(time=t, displacement=y)
    forms = [("f", experiment), ("g", {"time": t, "displacement": y}), {"record": "h", "time": t, "displacement": y}]
    rows = list(km.fit_many(ARRAYS, forms))
    assert all(row.error is None and row.estimates == rows[0].estimates for row in rows)


def test_values_of_a_record_change_its_model():
    (_, arrays), *_ = pairs(1)
    records = [
        {"record": "light", **arrays},
        {"record": "heavy", **arrays, "mass": 2.0},
        {"record": "part", **arrays, "window": (0.0, 5.0)},
    ]
    light, heavy, part = km.fit_many(ARRAYS, records)
    # Without a force only the ratios to the mass are in the record.
    ratio = heavy.estimates["stiffness"]["value"] / light.estimates["stiffness"]["value"]
    assert abs(ratio - 2.0) < 1e-6
    short = ARRAYS.fit(km.Experiment(arrays, window={"min": 0.0, "max": 5.0})).result
    assert part.estimates == short["estimates"]


@pytest.mark.parametrize("make", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_executors_give_the_same_rows(make, expected):
    with make(2) as executor:
        assert plain(km.fit_many(ARRAYS, pairs(24), executor)) == expected
    assert plain(km.fit_many(ARRAYS, pairs(24), threads=1, batch=5)) == expected


def test_records_are_read_as_far_as_needed():
    taken = []

    def endless():
        for name, arrays in pairs(1_000_000):
            taken.append(name)
            yield name, arrays

    with km.fit_many(ARRAYS, endless(), threads=2, batch=1) as rows:
        assert next(rows).record == "a000"
        # Three tasks of one record for each thread, and the one that was looked at.
        assert len(taken) <= 8
    with pytest.raises(TypeError, match="unknown"):
        len(rows)
    assert len(km.fit_many(ARRAYS, list(pairs(3)))) == 3


def test_an_interrupted_fleet_continues(tmp_path, expected):
    out = tmp_path / "fleet"
    with km.fit_many(ARRAYS, pairs(24), out=out, batch=1, threads=1) as rows:
        first = [next(rows) for _ in range(7)]
    written = (out / "rows.jsonl").read_text().splitlines()
    assert [json.loads(line)["record"] for line in written] == [row.record for row in first]
    with open(out / "rows.jsonl", "a") as lines:
        lines.write('{"record":"a0')
    rows = list(km.fit_many(ARRAYS, pairs(24), out=out))
    assert plain(rows) == expected
    assert [row["seconds"] for row in rows[:7]] == [row["seconds"] for row in first], "these were not fitted again"
    assert len((out / "rows.jsonl").read_text().splitlines()) == 24 and plain(km.read_fleet(out)) == expected
    # Each record is compared with that of its row; fewer are no other fleet.
    assert plain(km.fit_many(ARRAYS, pairs(23), out=out)) == expected[:23]
    with pytest.raises(km.InputError, match="another fleet"):
        km.fit_many(km.Model(mass=2.0), pairs(24), out=out)
    other = [(name, {**arrays, "displacement": 2 * arrays["displacement"]}) for name, arrays in pairs(2)]
    with pytest.raises(km.InputError, match="changed since its row was written"):
        list(km.fit_many(ARRAYS, other, out=out))


def test_bad_records_are_rows():
    records = [*pairs(2), ("short", {"time": [0.0, 0.1], "displacement": [1.0]}), ("../../evil\n<b>", next(pairs(1))[1])]
    rows = list(km.fit_many(ARRAYS, records, out=None))
    assert [row.error is None for row in rows] == [True, True, False, True]
    assert "unequal lengths" in rows[2].error and rows[2].estimates == {} and rows[2].verdict is None
    [row] = km.fit_many(ARRAYS, ["absent.csv"])
    assert "the model has no experiment" in row.error


def test_bad_calls_are_refused(tmp_path):
    def message(*arguments, **keywords):
        with pytest.raises(km.InputError) as caught:
            list(km.fit_many(*arguments, **keywords))
        return str(caught.value)

    assert "threads" in message(ARRAYS, pairs(1), thread=2)
    assert "fit_many.batch: invalid number" in message(ARRAYS, pairs(1), batch=0)
    assert "no records" in message(ARRAYS, 3)
    assert "no file matches this pattern" in message(ARRAYS, str(tmp_path / "*.csv"))
    assert "two records have the same name" in message(ARRAYS, [*pairs(1), *pairs(1)])
    assert "not a record" in message(ARRAYS, [3])
    assert "no data, or several" in message(ARRAYS, [{"record": "a", "mass": 2.0}])
    assert "did you mean" in message(ARRAYS, [{"record": "a", "file": "a.csv", "function.mass": 2.0}])
    assert "the model of a fleet has one experiment" in message(
        km.Model.from_yaml(MODEL.replace("functions:", "  - {data: b.csv, initial: estimate}\nfunctions:")), pairs(1)
    )


class Faulty:
    """An executor in this thread, the tasks of which fail `failures` times each."""

    _max_workers = 1

    def __init__(self, failures):
        self.failures = failures
        self.tries = {}

    def submit(self, function, fleet, job, records):
        future = Future()
        name = records[0].name
        self.tries[name] = self.tries.get(name, 0) + 1
        if self.tries[name] <= self.failures:
            future.set_exception(OSError("the connection is closed"))
        else:
            future.set_result(function(fleet, job, records))
        return future


def test_workers_that_die(tmp_path, expected):
    assert plain(km.fit_many(ARRAYS, pairs(24), Faulty(3))) == expected
    with pytest.raises(km.NumericalError, match="the workers fail .OSError: the connection is closed"):
        list(km.fit_many(ARRAYS, pairs(3), Faulty(4)))


def test_errors_are_tried_again(tmp_path):
    good = dict(pairs(1))["a000"]
    (tmp_path / "good.csv").write_text("t,y\n" + "".join(f"{t},{y}\n" for t, y in zip(good["time"], good["displacement"])))
    model = tmp_path / "model.yaml"
    model.write_text(
        "format: 1\n"
        "experiments: [{data: good.csv, columns: {time: t, displacement: y}, sigma: {displacement: estimate}, initial: estimate}]\n"
        "functions: {mass: {fixed: 1.0}, damping: {basis: constant, start: 0.1}, stiffness: {basis: constant, start: 4.0}}\n"
    )
    bad = tmp_path / "bad.csv"
    bad.write_text("")
    files = [str(tmp_path / "good.csv"), str(bad)]
    out = tmp_path / "fleet"
    assert [row.error is None for row in km.fit_many(model, files, out=out)] == [True, False]
    bad.write_bytes((tmp_path / "good.csv").read_bytes())
    assert [row.error is None for row in km.fit_many(model, files, out=out)] == [True, True]
    assert [row.error is None for row in km.read_fleet(out)] == [True, True]


def test_a_broken_executor_ends_the_fleet_without_false_rows(tmp_path, expected):
    out = tmp_path / "fleet"
    with ProcessPoolExecutor(2) as executor:
        rows = km.fit_many(ARRAYS, pairs(24), executor, out=out, batch=1)
        first = [next(rows) for _ in range(4)]
        os.kill(next(iter(executor._processes)), signal.SIGKILL)
        with pytest.raises(km.NumericalError, match="takes no more tasks"):
            list(rows)
    assert all(row.error is None for row in first)
    assert plain(km.fit_many(ARRAYS, pairs(24), out=out)) == expected


def test_rows_as_a_table():
    pandas = pytest.importorskip("pandas")
    table = km.fit_many(ARRAYS, list(pairs(3))).to_pandas()
    assert list(table["record"]) == ["a000", "a001", "a002"]
    assert (table["stiffness_low"] < table["stiffness"]).all() and (table["stiffness"] < table["stiffness_high"]).all()
    frames = [(name, pandas.DataFrame(arrays)) for name, arrays in pairs(3)]
    assert plain(km.fit_many(ARRAYS, frames)) == plain(km.fit_many(ARRAYS, pairs(3)))


def test_a_cluster_of_dask(tmp_path, expected):
    """Two worker processes, of which one is killed in mid-run; partitions of a bag and of a DataFrame."""
    distributed = pytest.importorskip("distributed", reason="Dask cannot be installed")
    import dask.bag

    kills = int(os.environ.get("KMCFIT_KILLS", "1"))
    count = 24 * kills
    local = expected if kills == 1 else plain(km.fit_many(ARRAYS, pairs(count)))
    chosen = np.random.default_rng()
    options = dict(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        rows = km.fit_many(ARRAYS, pairs(count), client, out=tmp_path / "fleet", batch=1)
        found = []
        for row in rows:
            if len(found) % 24 == 5:
                # In mid-run: the tasks of the worker are in flight.
                workers = [nanny.process.pid for nanny in cluster.workers.values() if nanny.process and nanny.process.pid]
                if workers:
                    os.kill(int(chosen.choice(workers)), signal.SIGKILL)
            found.append(row)
        assert plain(found) == local
        assert plain(km.read_fleet(tmp_path / "fleet")) == local
        bag = dask.bag.from_sequence(pairs(24), npartitions=4)
        assert plain(bag.map_partitions(lambda part: km.fit_partition(ARRAYS, part)).compute()) == expected
        try:
            import dask.dataframe
            import pandas
        except ImportError:
            return
        samples = pandas.concat(pandas.DataFrame({"record": name, **arrays}) for name, arrays in pairs(4))
        parts = dask.dataframe.from_delayed([dask.delayed(samples[samples["record"].isin(names)]) for names in (["a000", "a001"], ["a002", "a003"])])

        def fitted(part):
            return km.fit_partition(ARRAYS, part.groupby("record")).to_pandas()

        meta = km.fit_many(ARRAYS, pairs(1)).to_pandas().iloc[:0]
        table = parts.map_partitions(fitted, meta=meta).compute()
        assert list(table["record"]) == [row["record"] for row in expected[:4]]
        assert list(table["stiffness"]) == [row["estimates"]["stiffness"]["value"] for row in expected[:4]]
