#!/usr/bin/env python3
"""Records per second of a fleet: `kmcfit fleet` and `km.fit_many` against SciPy under joblib, single runs, one thread, and cold starts.

Each record: 2000 samples of a free decay at 50 Hz, noise of 0.02 m beside an amplitude of 1 m; m = 1 kg is known; damping, a stiffness that
varies linearly over time, and the initial state are sought (5 parameters). A further row has records under a measured force, whose fits
include the tests of the force. SciPy's `least_squares` solves the same problem with the same
sigma and start, its forward solve (RK4) compiled by numba, in the faster of its methods `lm` and `trf`.
Writes benches/FLEET.md.

usage: benches/fleet.py FOLDER [RECORDS]   needs: kmcfit (the package), numpy scipy numba joblib; KMCFIT_PROGRAM: the program
"""

import json
import os
import platform
import statistics
import subprocess
import sys
import time
from pathlib import Path

import joblib
import numba
import numpy as np
from scipy.optimize import least_squares

import kmcfit as km

SAMPLES, STEP, SIGMA = 2000, 0.02, 0.02
#: Records with a force.
FORCED = 30
START = (0.2, 36.0, 36.0)
PROGRAM = os.environ.get("KMCFIT_PROGRAM", "kmcfit")
MODEL = f"""\
format: 1
title: Fleet of decays
experiments:
  - data: decays/00000.npz
    columns: {{time: t, displacement: y}}
    sigma: {{displacement: {SIGMA}}}
    initial: estimate
grid: {{nodes: {SAMPLES}, method: rk4}}
functions:
  mass: {{fixed: 1.0}}
  damping: {{basis: constant, start: {START[0]}}}
  stiffness: {{basis: piecewise-linear, knots: 2, start: {START[1]}}}
fit: {{method: gauss-newton, stop: {{iterations: 100, tolerance: 1e-8}}}}
"""


@numba.njit(cache=True)
def response(p, f, h):
    """Displacement at the samples; the force is linear between them, the stiffness over the record."""
    c, k0, k1, x, v = p[0], p[1], p[2], p[3], p[4]
    n = f.size
    y = np.empty(n)
    slope = (k1 - k0) / (n - 1)
    for i in range(n):
        y[i] = x
        if i + 1 == n:
            break
        ka, kb = k0 + slope * i, k0 + slope * (i + 1)
        km_, fm = 0.5 * (ka + kb), 0.5 * (f[i] + f[i + 1])
        a1 = f[i] - c * v - ka * x
        x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
        a2 = fm - c * v2 - km_ * x2
        x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
        a3 = fm - c * v3 - km_ * x3
        x4, v4 = x + h * v3, v + h * a3
        a4 = f[i + 1] - c * v4 - kb * x4
        x += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return y


def make(folder, count):
    for kind in ("decays", "forced"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    (folder / "model.yaml").write_text(MODEL)
    (folder / "forced.yaml").write_text(MODEL.replace("y}", "y, force: f}").replace("decays", "forced"))
    t = STEP * np.arange(SAMPLES)
    for i, kind in [*((i, "decays") for i in range(count)), *((i, "forced") for i in range(FORCED))]:
        path = folder / f"{kind}/{i:05}.npz"
        if path.exists():
            continue
        random = np.random.default_rng(i)
        k0 = 40.0 * np.exp(0.1 * random.standard_normal())
        truth = np.array([0.3 * np.exp(0.2 * random.standard_normal()), k0, k0 * (0.95 + 0.04 * random.standard_normal()), 1.0 * (kind == "decays"), 0.0])
        f = np.convolve(random.standard_normal(SAMPLES + 8), np.ones(9) / 3, "valid") * 4 * (kind == "forced")
        y = response(truth, f, STEP) + SIGMA * random.standard_normal(SAMPLES)
        np.savez(path, t=t, f=f, y=y)


def peer(path, method):
    """Estimates of SciPy with their standard errors."""
    with np.load(path) as data:
        f, y = data["f"], data["y"]
    start = np.array([*START, y[0], 0.0])
    found = least_squares(lambda p: (response(p, f, STEP) - y) / SIGMA, start, method=method, xtol=1e-8, ftol=1e-8, gtol=1e-8)
    return found.x, np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)))


def timed(work):
    begin = time.perf_counter()
    result = work()
    return result, time.perf_counter() - begin


def run(folder, *words):
    """Runs the program; its time in s and its peak memory in MB."""
    begin = time.perf_counter()
    process = subprocess.Popen([PROGRAM, *words], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    errors = process.stderr.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(errors.decode())
    return time.perf_counter() - begin, usage.ru_maxrss / 1024


def without_errors(out, count):
    """Stops where a row is missing or has an error: its time would be none of a fit."""
    rows = km.read_fleet(out)
    if len(rows) != count or any(row.error for row in rows):
        sys.exit(f"{out}: rows are missing or have errors")


def fleet(folder, count, *options, name="out"):
    """Time and memory of a fleet of the first records."""
    table = folder / f"first-{count}.csv"
    table.write_text("file,system\n" + "".join(f"decays/{i:05}.npz,a\n" for i in range(count)))
    subprocess.run(["rm", "-rf", str(folder / name)], check=True)
    found = run(folder, "fleet", "model.yaml", table.name, "--out", name, *options)
    without_errors(folder / name, count)
    return found


def main():
    folder, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
    make(folder, count)
    few, single = max(1, min(count // 10, 1000)), 30
    paths = [folder / f"decays/{i:05}.npz" for i in range(few)]
    lines = []

    def row(what, number, seconds, more=""):
        lines.append(f"| {what} | {number} | {seconds:.2f} s | {number / seconds:.0f} | {more} |")
        print(lines[-1], flush=True)

    row_of = {}
    for method in ("lm", "trf"):
        peer(paths[0], method)  # compiled
    for method in ("lm", "trf"):
        joblib.Parallel(2)(joblib.delayed(peer)(path, method) for path in paths[:8])
        found, seconds = timed(lambda: joblib.Parallel(2)(joblib.delayed(peer)(path, method) for path in paths))
        row_of[method] = few / seconds, found
        row(f"SciPy `{method}`, joblib, 2 processes", few, seconds)
    speeds = {}
    for threads in ("1", "2"):
        times = [fleet(folder, few, "--threads", threads)[0] for _ in range(3)]
        speeds[threads] = few / statistics.median(times)
        row(f"`kmcfit fleet --threads {threads}`", few, statistics.median(times))
    rows = km.read_fleet(folder / "out")
    _, seconds = timed(lambda: list(km.fit_many(folder / "model.yaml", list(map(str, paths)), threads=2)))
    row("`km.fit_many`, 2 threads", few, seconds)
    warm = fleet(folder, few, "--threads", "2", "--warm-start", name="warm")[0]
    row("`kmcfit fleet --threads 2 --warm-start`", few, warm)
    singles = sum(run(folder, "fit", "model.yaml", "--set", f"experiments.0.data=decays/{i:05}.npz", "--out", "single")[0] for i in range(single))
    row("single runs of `kmcfit fit`", single, singles)
    subprocess.run(["rm", "-rf", str(folder / "out-forced")], check=True)
    forced = run(folder, "fleet", "forced.yaml", "forced/*.npz", "--out", "out-forced", "--threads", "2")[0]
    without_errors(folder / "out-forced", FORCED)
    row("`kmcfit fleet --threads 2`, records with a force", FORCED, forced)
    memory = {}
    for number in (few, count):
        seconds, memory[number] = fleet(folder, number, "--threads", "2", name="many")
        row("`kmcfit fleet --threads 2`", number, seconds, f"peak {memory[number]:.0f} MB")

    def distance(others):
        """Largest difference of an estimate, in parts of its standard error, and the median of those of records."""
        parts = []
        for own, other in zip(rows, others):
            damping = own["estimates"]["damping"]
            if damping["ci95"] is None:  # residuals that chance made significant
                continue
            error = (damping["ci95"][1] - damping["ci95"][0]) / (2 * 1.96)
            parts.append(abs(damping["value"] - other) / error)
        return statistics.median(parts), max(parts)

    best = max(("lm", "trf"), key=lambda method: row_of[method][0])
    to_scipy = distance([x[0] for x, _ in row_of[best][1]])
    to_warm = distance([row["estimates"]["damping"]["value"] for row in km.read_fleet(folder / "warm")])
    verdicts = [sum(row["verdict"] == level for row in rows) for level in ("adequate", "check", "inadequate")]
    ratios = [
        ("records per second against SciPy under joblib", speeds["2"] / row_of[best][0], 30),
        ("against single runs", speeds["2"] * singles / single, 5),
        ("two threads against one", speeds["2"] / speeds["1"], 1.6),
        ("warm against cold starts", few / warm / speeds["2"], None),
        ("peak memory at the larger number of records against the smaller", max(memory.values()) / min(memory.values()), None),
    ]
    cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine())
    text = f"""# Fleets

`benches/fleet.py` on {cpu}, {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f} of other processes at the end. Records of {SAMPLES} samples, 5 parameters,
NumPy archives on disk. A row of kmcfit has intervals, tests of the residuals and a verdict beside the estimates; SciPy gives estimates and
a Jacobian.

| | records | time | records/s | |
|---|---|---|---|---|
{chr(10).join(lines)}

| ratio | measured | target |
|---|---|---|
""" + "".join(f"| {name} | {value:.2f} | {'' if target is None else f'at least {target}'} |\n" for name, value, target in ratios) + f"""
Estimates of the damping differ from those of SciPy by {to_scipy[0]:.1e} (median) and {to_scipy[1]:.1e} (largest) standard errors, those of warm starts
from cold ones by {to_warm[0]:.1e} and {to_warm[1]:.1e}. Verdicts: {verdicts[0]} adequate, {verdicts[1]} check, {verdicts[2]} inadequate.
"""
    (Path(__file__).parent / "FLEET.md").write_text(text)
    print(json.dumps({name: value for name, value, _ in ratios}))


if __name__ == "__main__":
    main()
