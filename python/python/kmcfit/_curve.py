"""Quantities over time."""

from __future__ import annotations

from typing import Any, Optional, Tuple

import numpy as np

from ._errors import InputError


class Curve:
    """A quantity over time: values at the nodes, linear in between."""

    def __init__(self, name: str, unit: str, times: "np.ndarray", values: "np.ndarray", band: Optional[Tuple[Any, Any]]) -> None:
        self.name = name
        self.unit = unit
        #: Times of the nodes, s.
        self.times = times
        #: Values at the nodes, in `unit`.
        self.values = values
        self._band = band

    def __repr__(self) -> str:
        low, high = np.nanmin(self.values), np.nanmax(self.values)
        return f"<Curve {self.name}: {low:.6g} to {high:.6g} {self.unit}>"

    def __call__(self, t: Any) -> Any:
        """Values at the times `t` (s, any shape), in `unit`; NaN outside the record."""
        return self._at(t, self.values)

    def band(self, t: Any = None, level: float = 0.95) -> Tuple[Any, Any]:
        """Lower and upper end of the pointwise confidence interval at the times `t` (default: at the nodes).

        The interval of 95 % is that of the run; others are scaled by the quantiles of the normal distribution.

        Raises
        ------
        InputError
            If the run has no intervals for the quantity, or `level` is not between 0 and 1.
        """
        if self._band is None:
            raise InputError("no confidence intervals", f"{self.name}.band", expected="a fit with `sigma` and identified parameters")
        if not 0.0 < level < 1.0:
            raise InputError("invalid level", f"{self.name}.band", repr(level), "a number between 0 and 1")
        factor = 1.0 if level == 0.95 else _quantile(level) / _quantile(0.95)
        ends = [self.values + factor * (end - self.values) if factor != 1.0 else end for end in self._band]
        if t is None:
            return ends[0].copy(), ends[1].copy()
        return self._at(t, ends[0]), self._at(t, ends[1])

    def _at(self, t: Any, values: "np.ndarray") -> Any:
        times = np.asarray(t, dtype=np.float64)
        found = np.interp(times, self.times, values, left=np.nan, right=np.nan)
        return float(found) if times.ndim == 0 else found


def _quantile(level: float) -> float:
    """Half width of the central interval of the standard normal distribution with the probability `level`."""
    from statistics import NormalDist

    return NormalDist().inv_cdf(0.5 + 0.5 * level)
