"""Fit of the Duffing record by lmfit; other start values of m, c, k, k3 as arguments."""
import sys
import lmfit
from system import NAMES, START, response, y

parameters = lmfit.Parameters()
for name, start in zip(NAMES, [*map(float, sys.argv[1:]), *START[len(sys.argv) - 1:]]):
    parameters.add(name, start, min=0.1 if name == "m" else -float("inf"))
found = lmfit.minimize(lambda p: response(**p.valuesdict()) - y, parameters)
for name in NAMES:
    print(f"{name:2} {found.params[name].value:.5f} +- {1.96 * found.params[name].stderr:.5f}")
print(f"residual {(found.chisqr / len(y)) ** 0.5:.5f} m rms; {found.message}")
