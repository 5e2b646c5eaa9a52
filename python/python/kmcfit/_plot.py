"""Figures by matplotlib, which is imported only here."""

from __future__ import annotations

from typing import Any, List, Mapping

from ._fit import Fit


def figure(fits: Mapping[str, Fit], quantities: List[str]) -> Any:
    """A figure with one panel for each quantity, and one curve with its 95 % band for each fit."""
    from matplotlib import pyplot

    made, axes = pyplot.subplots(
        len(quantities), 1, sharex=True, squeeze=False, figsize=(6.4, 1.2 + 2.2 * len(quantities)), layout="constrained"
    )
    for (panel,), quantity in zip(axes, quantities):
        for name, fit in fits.items():
            curve = fit.curve(quantity)
            (line,) = panel.plot(curve.times, curve.values, label=name or "estimate")
            if curve._band is not None:
                low, high = curve.band()
                panel.fill_between(curve.times, low, high, alpha=0.25, color=line.get_color(), label="95 %" if not name else None)
        unit = f" ({curve.unit})" if curve.unit else ""
        panel.set_ylabel(quantity.replace("_", " ") + unit)
    axes[0][0].legend()
    axes[-1][0].set_xlabel("time (s)")
    return made
