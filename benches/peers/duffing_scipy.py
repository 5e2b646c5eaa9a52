"""Peer: SciPy least_squares over a numba-compiled RK4 (forced, nonlinear: m y'' + c y' + k y + k3 y^3 = f).
65,000 samples of force, displacement and acceleration, 1 kHz, noise of about 1 %; m, c, k, k3 are sought from
(1.2, 1, 18, 12), the truth is (1, 1.2, 20, 15), the initial state is known. Three Jacobians: SciPy's default
(2-point differences) with both of its unbounded methods, and forward sensitivities, compiled as well.
The data and the model that kmcfit fits are written to FOLDER: duffing_long.csv, duffing_long.yaml.
usage: duffing_scipy.py FOLDER [SAMPLES]   needs: pip install numpy scipy numba"""
import os
import sys
import time

import numba
import numpy as np
from scipy.optimize import least_squares

folder = sys.argv[1]
n = int(sys.argv[2]) if len(sys.argv) > 2 else 65_000
dt = 0.001
t = dt * np.arange(n)
truth, start = np.array([1.0, 1.2, 20.0, 15.0]), np.array([1.2, 1.0, 18.0, 12.0])
sigma_y, sigma_a, tolerance = 0.005, 0.05, 1e-8
force = 4 * np.sin(3.1 * t) + 3 * np.sin(5.3 * t + 1) + 2 * np.sin(9.7 * t + 2)


@numba.njit
def motion(p, f, dt):
    """Displacement and acceleration at the samples; the force is linear between them."""
    m, c, k, k3 = p
    y, a = np.empty(f.size), np.empty(f.size)
    x = v = 0.0
    for i in range(f.size):
        y[i] = x
        a[i] = (f[i] - c * v - (k + k3 * x * x) * x) / m
        if i + 1 == f.size:
            break
        fh = 0.5 * (f[i] + f[i + 1])
        x2, v2 = x + 0.5 * dt * v, v + 0.5 * dt * a[i]
        a2 = (fh - c * v2 - (k + k3 * x2 * x2) * x2) / m
        x3, v3 = x + 0.5 * dt * v2, v + 0.5 * dt * a2
        a3 = (fh - c * v3 - (k + k3 * x3 * x3) * x3) / m
        x4, v4 = x + dt * v3, v + dt * a3
        a4 = (f[i + 1] - c * v4 - (k + k3 * x4 * x4) * x4) / m
        x += dt / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += dt / 6 * (a[i] + 2 * a2 + 2 * a3 + a4)
    return y, a


@numba.njit
def stage(p, f, x, v, dx, dv, h, slope_x, da):
    """Acceleration, and into da its derivatives by m, c, k, k3 where those of x are dx + h slope_x."""
    m, c, k, k3 = p
    a = (f - c * v - (k + k3 * x * x) * x) / m
    slope = k + 3 * k3 * x * x
    push = (a, v, x, x * x * x)
    for j in range(4):
        da[j] = -(c * dv[j] + slope * (dx[j] + h * slope_x[j]) + push[j]) / m
    return a


@numba.njit
def sensitivities(p, f, dt, sigma_y, sigma_a):
    """Jacobian of the residuals by forward sensitivities."""
    jacobian = np.empty((2 * f.size, 4))
    x = v = 0.0
    dx, dv = np.zeros(4), np.zeros(4)
    d1, d2, d3, d4 = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    dv2, dv3, dv4 = np.empty(4), np.empty(4), np.empty(4)
    for i in range(f.size):
        a1 = stage(p, f[i], x, v, dx, dv, 0.0, dv, d1)
        for j in range(4):
            jacobian[i, j] = dx[j] / sigma_y
            jacobian[f.size + i, j] = d1[j] / sigma_a
        if i + 1 == f.size:
            break
        fh = 0.5 * (f[i] + f[i + 1])
        x2, v2 = x + 0.5 * dt * v, v + 0.5 * dt * a1
        for j in range(4):
            dv2[j] = dv[j] + 0.5 * dt * d1[j]
        a2 = stage(p, fh, x2, v2, dx, dv2, 0.5 * dt, dv, d2)
        x3, v3 = x + 0.5 * dt * v2, v + 0.5 * dt * a2
        for j in range(4):
            dv3[j] = dv[j] + 0.5 * dt * d2[j]
        a3 = stage(p, fh, x3, v3, dx, dv3, 0.5 * dt, dv2, d3)
        x4, v4 = x + dt * v3, v + dt * a3
        for j in range(4):
            dv4[j] = dv[j] + dt * d3[j]
        a4 = stage(p, f[i + 1], x4, v4, dx, dv4, dt, dv3, d4)
        x += dt / 6 * (v + 2 * v2 + 2 * v3 + v4)
        v += dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        for j in range(4):
            dx[j] += dt / 6 * (dv[j] + 2 * dv2[j] + 2 * dv3[j] + dv4[j])
            dv[j] += dt / 6 * (d1[j] + 2 * d2[j] + 2 * d3[j] + d4[j])
    return jacobian


y_true, a_true = motion(truth, force, dt)
noise = np.random.default_rng(1)
y_read = y_true + sigma_y * noise.standard_normal(n)
a_read = a_true + sigma_a * noise.standard_normal(n)


def residual(p):
    y, a = motion(p, force, dt)
    return np.concatenate(((y - y_read) / sigma_y, (a - a_read) / sigma_a))


def jacobian(p):
    return sensitivities(p, force, dt, sigma_y, sigma_a)


MODEL = """# A hardening spring under three sines, seen by two sensors; made by duffing_scipy.py.
format: 1
title: A long forced Duffing record
experiments:
  - name: three sines
    data: duffing_long.csv
    columns: {time: t_s, displacement: y_m, acceleration: a_m_per_s2, force: f_N}
    sigma: {displacement: %g, acceleration: %g}
    initial: {displacement: 0.0, velocity: 0.0}
grid: {nodes: %d, method: rk4}
functions:
  mass:            {basis: constant, start: %g}
  damping:         {basis: constant, start: %g}
  stiffness:       {basis: constant, start: %g}
  cubic_stiffness: {basis: constant, start: %g}
fit: {method: gauss-newton, initial: functions, stop: {iterations: 100, tolerance: %g}}
"""
os.makedirs(folder, exist_ok=True)
with open(os.path.join(folder, "duffing_long.csv"), "w") as table:
    table.write("t_s,f_N,y_m,a_m_per_s2\n")
    for row in zip(t.tolist(), force.tolist(), y_read.tolist(), a_read.tolist()):
        table.write("%r,%r,%r,%r\n" % row)
with open(os.path.join(folder, "duffing_long.yaml"), "w") as model:
    model.write(MODEL % (sigma_y, sigma_a, n, *start, tolerance))

# Compiled before the clock starts.
residual(start), jacobian(start)
for name, method, derivative in [
    ("trf, 2-point", "trf", "2-point"),
    ("lm, 2-point", "lm", "2-point"),
    ("trf, sensitivities", "trf", jacobian),
    ("lm, sensitivities", "lm", jacobian),
]:
    clock = time.perf_counter()
    found = least_squares(residual, start, jac=derivative, method=method, x_scale="jac",
                          ftol=tolerance, xtol=tolerance, gtol=tolerance)
    seconds = time.perf_counter() - clock
    errors = " ".join("%s %.1e" % (q, abs(x - e)) for q, x, e in zip(("m", "c", "k", "k3"), found.x, truth))
    print(f"scipy duffing ({name}): {seconds:.4f} s, nfev {found.nfev}, J {2 * found.cost:.9e}, errors {errors}")
