"""The cost of a fit and its derivatives as functions of the parameters."""

from __future__ import annotations

from typing import Any, List, Tuple

import numpy as np

from . import _kmcfit
from ._arrays import column
from ._errors import InputError


class Problem:
    """The cost J of a model and its records as a function of the parameter vector theta, for other optimisers and samplers.

    J is the sum of the misfit (for known sigmas ``sum(weights * residuals**2)``, which is minus twice the log-likelihood up to a
    constant), of penalties and of priors. Bounds and linear constraints are not part of J.

    Attributes
    ----------
    names : list of str
        Names of the parameters.
    start : ndarray, shape (p,)
        The starting point of the fit.
    observed : ndarray, shape (n,)
        Samples of all channels of all experiments, in order, SI.
    """

    def __init__(self, raw: "_kmcfit.Problem") -> None:
        self._raw = raw
        self.names: List[str] = raw.names()
        self.start = np.frombuffer(raw.start()).copy()
        self.observed = np.frombuffer(raw.observed()).copy()

    def __repr__(self) -> str:
        return f"<Problem of {len(self.names)} parameters and {len(self.observed)} samples>"

    def cost(self, theta: Any) -> float:
        """J(theta). NumericalError where theta has no finite response, e.g. for a mass that is not positive."""
        return self._raw.cost(self._bytes("theta", theta, len(self.names)))

    def gradient(self, theta: Any) -> "np.ndarray":
        """dJ/dtheta, shape (p,), by the discrete adjoint."""
        return self.cost_and_gradient(theta)[1]

    def cost_and_gradient(self, theta: Any) -> Tuple[float, "np.ndarray"]:
        """J and dJ/dtheta from one simulation; for ``scipy.optimize.minimize(…, jac=True)``."""
        cost, gradient = self._raw.cost_and_gradient(self._bytes("theta", theta, len(self.names)))
        return cost, np.frombuffer(gradient).copy()

    def residuals(self, theta: Any) -> "np.ndarray":
        """Simulated minus measured samples, shape (n,), SI."""
        return self.predict(theta) - self.observed

    def predict(self, theta: Any) -> "np.ndarray":
        """Simulated samples of all channels, shape (n,), SI."""
        return np.frombuffer(self._raw.predict(self._bytes("theta", theta, len(self.names)))).copy()

    def weights(self, theta: Any) -> "np.ndarray":
        """Weights of the squared residuals in the misfit, shape (n,): 1/sigma^2, or those of the integral in time.

        With a robust loss those of the least-squares problem with the same gradient at `theta`; for correlated noise those of white
        noise.
        """
        return np.frombuffer(self._raw.weights(self._bytes("theta", theta, len(self.names)))).copy()

    def jvp(self, theta: Any, along: Any) -> "np.ndarray":
        """Derivative of `predict` along a direction, shape (n,), by one tangent solve."""
        count = len(self.names)
        return np.frombuffer(self._raw.jvp(self._bytes("theta", theta, count), self._bytes("along", along, count))).copy()

    def vjp(self, theta: Any, slopes: Any) -> "np.ndarray":
        """Transposed Jacobian of `predict` times `slopes` (shape (n,)), shape (p,), by one adjoint solve."""
        theta = self._bytes("theta", theta, len(self.names))
        return np.frombuffer(self._raw.vjp(theta, self._bytes("slopes", slopes, len(self.observed)))).copy()

    def jacobian(self, theta: Any) -> "np.ndarray":
        """Jacobian of `predict`, shape (n, p)."""
        flat = np.frombuffer(self._raw.jacobian(self._bytes("theta", theta, len(self.names))))
        return flat.reshape((len(self.names), len(self.observed))).T.copy()

    def _bytes(self, name: str, values: Any, length: int) -> bytes:
        array = column(name, values)
        if len(array) != length:
            raise InputError("wrong length", name, f"{len(array)} values", f"{length} values")
        if not np.isfinite(array).all():
            raise InputError("not finite", name, str(array[~np.isfinite(array)][0]), "finite numbers")
        return array.tobytes()
