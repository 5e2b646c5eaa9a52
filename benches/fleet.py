#!/usr/bin/env python3
"""Records a second of `kmcfit fleet` and of SciPy's least squares, in turns on the same cores.

Usage: benches/fleet.py [RECORDS]       needs numpy, scipy, numba and joblib; KMCFIT: the program, target/release/kmcfit by default

Free decays of 600 samples with 1 % noise: mass known; damping, stiffness, initial displacement and velocity and the standard deviation of the
noise estimated, with 95 % intervals. SciPy has the closed response with its derivatives, compiled by numba, and arrays in memory; kmcfit reads CSV
files and integrates, tests the residuals and judges candidates. Printed: records a second, their ratio, and how many intervals hold.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import joblib
import numba
import numpy as np
from scipy.optimize import least_squares

SAMPLES, SPACING, MASS, DAMPING, STIFFNESS = 600, 0.02, 2.0, 0.6, 200.0
ROUNDS = 3
PROGRAM = Path(os.environ.get("KMCFIT", "target/release/kmcfit")).resolve()
MODEL = """format: 1
title: fleet
experiments:
  - data: record0.csv
    columns: {time: t, displacement: y}
    sigma: {displacement: estimate}
    initial: estimate
functions:
  mass: {fixed: 2.0}
  damping: {basis: constant, start: 1.0}
  stiffness: {basis: constant, start: 190.0}
"""


@numba.njit(cache=True)
def response(theta, t):
    """Displacement of a free decay and its derivatives with respect to c, k, y0, v0."""
    c, k, y0, v0 = theta
    g = c / (2 * MASS)
    w = np.sqrt(k / MASS - g * g)
    y, slopes = np.empty(len(t)), np.empty((len(t), 4))
    for i in range(len(t)):
        e, cos, sin = np.exp(-g * t[i]), np.cos(w * t[i]), np.sin(w * t[i])
        b = (v0 + g * y0) / w
        y[i] = e * (y0 * cos + b * sin)
        by_g = -t[i] * y[i] + e * y0 / w * sin
        by_w = e * (t[i] * (b * cos - y0 * sin) - b / w * sin)
        slopes[i, 0] = (by_g - by_w * g / w) / (2 * MASS)
        slopes[i, 1] = by_w / (2 * w * MASS)
        slopes[i, 2] = e * (cos + g / w * sin)
        slopes[i, 3] = e * sin / w
    return y, slopes


def by_scipy(t, y):
    start = np.array([1.0, 190.0, y[0], 0.0])
    fit = least_squares(lambda x: response(x, t)[0] - y, start, jac=lambda x: response(x, t)[1], x_scale="jac", method="trf")
    variance = 2 * fit.cost / (len(t) - 5)
    errors = np.sqrt(variance * np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))
    return fit.x, 1.96 * errors


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 2000
    random = np.random.default_rng(1)
    t = SPACING * np.arange(SAMPLES)
    true = np.array([DAMPING, STIFFNESS, 1.0, 0.0])
    exact = response(true, t)[0]
    records = exact + 0.01 * random.standard_normal((count, SAMPLES))
    cores = os.cpu_count()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        (folder / "model.yaml").write_text(MODEL)
        for i, y in enumerate(records):
            np.savetxt(folder / f"record{i}.csv", np.column_stack([t, y]), fmt="%.9g", delimiter=",", header="t,y", comments="")
        with joblib.Parallel(n_jobs=cores) as parallel:
            chunks = np.array_split(records, 8 * cores)
            work = joblib.delayed(lambda part: [by_scipy(t, y) for y in part])
            parallel(work(part[:1]) for part in chunks)
            for turn in range(ROUNDS):
                begin = time.perf_counter()
                found = [fit for part in parallel(work(part) for part in chunks) for fit in part]
                scipy = time.perf_counter() - begin
                held = [sum(abs(x[j] - true[j]) < half[j] for x, half in found) / count for j in range(2)]
                out = folder / f"fleet{turn}"
                command = [PROGRAM, "fleet", "model.yaml", "record*.csv", "--out", out]
                begin = time.perf_counter()
                subprocess.run(command, cwd=folder, check=True, capture_output=True)
                own = time.perf_counter() - begin
                rows = [json.loads(line) for line in (out / "rows.jsonl").read_text().splitlines()]
                rows = [row for row in rows if "estimates" in row]
                adequate = sum(row["verdict"] == "adequate" for row in rows) / len(rows)
                inside = []
                for name, value in [("damping", DAMPING), ("stiffness", STIFFNESS)]:
                    intervals = [row["estimates"][name]["ci95"] for row in rows if row["estimates"][name].get("ci95")]
                    inside.append(sum(low < value < high for low, high in intervals) / len(rows))
                print(
                    f"SciPy {count / scipy:.0f} records/s (c, k inside {held[0]:.3f}, {held[1]:.3f}); "
                    f"kmcfit {len(rows) / own:.0f} records/s (inside {inside[0]:.3f}, {inside[1]:.3f}; adequate {adequate:.3f}); "
                    f"ratio {scipy / own * len(rows) / count:.2f}"
                )


if __name__ == "__main__":
    main()
