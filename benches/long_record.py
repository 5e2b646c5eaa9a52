#!/usr/bin/env python3
"""Writes a record of a hardening oscillator under a random force, sampled at 100 Hz with noise of 5 % on the acceleration, and its model of
eight parameters.

usage: benches/long_record.py FOLDER SAMPLES   needs: numpy numba
"""

import sys
from pathlib import Path

import numba
import numpy as np

STEP, NOISE = 0.01, 0.05
MODEL = """\
format: 1
title: Long record
experiments:
  - data: long-{n}.csv
    columns: {{time: t, force: f, acceleration: a}}
    sigma: {{acceleration: estimate}}
    initial: estimate
functions:
  mass: {{basis: constant, start: 1.2}}
  damping: {{basis: constant, start: 0.3}}
  stiffness: {{basis: piecewise-linear, knots: 3, start: 35}}
  cubic_stiffness: {{basis: constant, start: 1.0}}
fit: {{method: gauss-newton}}
"""


@numba.njit(cache=True)
def acceleration(f, h, m, c, k, k3):
    """From rest by RK4, the force linear between the samples."""
    a, x, v = np.empty(f.size), 0.0, 0.0
    for i in range(f.size):
        a1 = (f[i] - c * v - k * x - k3 * x**3) / m
        a[i] = a1
        if i + 1 == f.size:
            break
        middle = 0.5 * (f[i] + f[i + 1])
        x2, v2 = x + 0.5 * h * v, v + 0.5 * h * a1
        a2 = (middle - c * v2 - k * x2 - k3 * x2**3) / m
        x3, v3 = x + 0.5 * h * v2, v + 0.5 * h * a2
        a3 = (middle - c * v3 - k * x3 - k3 * x3**3) / m
        x4, v4 = x + h * v3, v + h * a3
        a4 = (f[i + 1] - c * v4 - k * x4 - k3 * x4**3) / m
        x += h / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
    return a


def main():
    folder, n = Path(sys.argv[1]), int(sys.argv[2])
    random = np.random.default_rng(1)
    f = 3 * np.convolve(random.standard_normal(n + 20), np.ones(21) / 5, "valid")
    a = acceleration(f, STEP, 1.0, 0.4, 40.0, 5.0)
    a += NOISE * a.std() * random.standard_normal(n)
    t = STEP * np.arange(n)
    with open(folder / f"long-{n}.csv", "w", encoding="utf-8") as table:
        table.write("t,f,a\n")
        for i in range(0, n, 100_000):
            rows = zip(t[i : i + 100_000], f[i : i + 100_000], a[i : i + 100_000])
            table.write("".join("%.2f,%.8g,%.8g\n" % row for row in rows))
    (folder / f"long-{n}.yaml").write_text(MODEL.format(n=n), encoding="utf-8")


if __name__ == "__main__":
    main()
