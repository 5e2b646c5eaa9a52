"""Fit of the Duffing record by pyPESTO: ten starting points, intervals from profiles."""
import logging
import numpy as np
import pypesto
import pypesto.optimize as optimize
import pypesto.profile as profile
from system import NAMES, START, response, y

np.random.seed(1)
logging.disable(logging.WARNING)
LOWER = [0.1, 0.0, 0.0, 0.0, -1.0, -2.0, np.log(1e-4)]
UPPER = [10.0, 2.0, 50.0, 100.0, 1.0, 2.0, np.log(1.0)]


def cost(theta):
    """Negative logarithm of the likelihood; the last parameter is ln(sigma)."""
    residuals = (response(*theta[:-1]) - y) / np.exp(theta[-1])
    value = 0.5 * np.sum(residuals**2) + len(y) * (theta[-1] + 0.5 * np.log(2 * np.pi))
    return value if np.isfinite(value) else 1e10


problem = pypesto.Problem(
    pypesto.FD(pypesto.Objective(cost)), LOWER, UPPER, x_names=[*NAMES, "ln_sigma"],
    x_guesses=[[*START, np.log(0.1)]],
    startpoint_method=pypesto.startpoint.UniformStartpoints())
optimizer = optimize.ScipyOptimizer("L-BFGS-B", options={"maxiter": 200})
result = optimize.minimize(problem, optimizer, n_starts=10, progress_bar=False)
best = result.optimize_result[0]
result = profile.parameter_profile(problem, result, optimizer, profile_index=range(4), progress_bar=False)
for i, name in enumerate(NAMES[:4]):
    of = result.profile_result.list[0][i]
    low, high = profile.calculate_approximate_ci(of.x_path[i], of.ratio_path, 0.1465)
    print(f"{name:2} {best.x[i]:.4f} ({low:.4f} to {high:.4f})")
print(f"sigma {np.exp(best.x[-1]):.5f} m")
