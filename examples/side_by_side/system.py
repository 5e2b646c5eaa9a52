"""The Duffing record and its response: what lmfit and pyPESTO leave to the user."""
import numpy as np
from scipy.interpolate import CubicSpline

t, f, y = np.loadtxt("data/duffing.csv", delimiter=",", skiprows=1, unpack=True)
h = t[1] - t[0]
middle = CubicSpline(t, f)(t[:-1] + 0.5 * h).tolist()
forces = f.tolist()
NAMES = ["m", "c", "k", "k3", "y0", "v0"]
START = [3.0, 0.0, 3.0, 0.0, float(y[0]), 0.0]


def response(m, c, k, k3, y0, v0):
    """Displacement at the samples by the classical Runge-Kutta method; large where the system diverges."""
    def rate(force, x, v):
        return (force - c * v - k * x - k3 * x * x * x) / m
    x, v, out = float(y0), float(v0), [float(y0)]
    for left, mid, right in zip(forces, middle, forces[1:]):
        a1 = rate(left, x, v)
        v2 = v + 0.5 * h * a1
        a2 = rate(mid, x + 0.5 * h * v, v2)
        v3 = v + 0.5 * h * a2
        a3 = rate(mid, x + 0.5 * h * v2, v3)
        v4 = v + h * a3
        a4 = rate(right, x + h * v3, v4)
        x, v = x + h / 6 * (v + 2 * v2 + 2 * v3 + v4), v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        if not abs(x) < 1e6:
            return np.full(len(t), 1e6)
        out.append(x)
    return np.array(out)
