"""Records and paths of the tests."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import kmcfit as km

ROOT = Path(__file__).resolve().parents[2]
MODELS = ROOT / "models"


def program(*words, cwd=ROOT):
    """Runs the command line: the program of KMCFIT_PROGRAM, or that of the package."""
    given = os.environ.get("KMCFIT_PROGRAM")
    command = [given] if given else [sys.executable, "-m", "kmcfit"]
    return subprocess.run([*command, *map(str, words)], cwd=cwd, capture_output=True, text=True)


def oscillator(mass, damping, stiffness, time, force, initial=(0.0, 0.0)):
    """States and acceleration of a linear oscillator under `force(t)`, by RK4 with a tenth of the sampling interval."""
    steps = 10
    fine = force(np.linspace(time[0], time[-1], steps * 2 * (len(time) - 1) + 1))
    h = (time[1] - time[0]) / steps

    def rate(y, f):
        return np.array([y[1], (f - damping * y[1] - stiffness * y[0]) / mass])

    y, states = np.array(initial, dtype=float), []
    for i in range(steps * (len(time) - 1) + 1):
        if i % steps == 0:
            states.append(y)
        if i == steps * (len(time) - 1):
            break
        a, b, c = fine[2 * i : 2 * i + 3]
        k1 = rate(y, a)
        k2 = rate(y + h / 2 * k1, b)
        k3 = rate(y + h / 2 * k2, b)
        k4 = rate(y + h * k3, c)
        y = y + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    states = np.array(states)
    return states, (force(time) - damping * states[:, 1] - stiffness * states[:, 0]) / mass


@pytest.fixture(scope="session")
def record():
    """Time, force and acceleration of m = 2.4 kg, c = 1 N s/m, k = 1500 N/m, with noise of 0.02 m/s^2."""
    time = np.linspace(0.0, 2.0, 401)

    def force(t):
        return 20.0 * np.sin(2 * np.pi * (2.0 * t + t**2))

    _, acceleration = oscillator(2.4, 1.0, 1500.0, time, force)
    noise = np.random.default_rng(1).standard_normal(len(time))
    return time, force(time), acceleration + 0.02 * noise


@pytest.fixture(scope="session")
def data(record):
    time, force, acceleration = record
    return km.Experiment(time=time, force=force, acceleration=acceleration)


@pytest.fixture(scope="session")
def fit(data):
    return km.Model(mass=2.4).fit(data)
