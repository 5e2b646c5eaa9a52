"""kmcfit: identifies time-varying mass, damping and stiffness of a vibrating system from measured records.

>>> import kmcfit as km
>>> model = km.Model(mass=2.4, damping=km.Constant(start=1.0), stiffness=km.BSpline(start=1500.0, min=0.0))
>>> data = km.Experiment(time=t, force=f, acceleration=a)      # doctest: +SKIP
>>> fit = model.fit(data)                                      # doctest: +SKIP
>>> fit.estimates, fit.stiffness(t), fit.verdict               # doctest: +SKIP
"""

from __future__ import annotations

from typing import Any, Dict

try:
    import numpy as _numpy  # noqa: F401

    from . import _kmcfit
except ImportError as _error:
    if "subinterpreter" in str(_error) or "more than once" in str(_error):
        raise ImportError("kmcfit cannot be imported in a subinterpreter; use threads or processes") from _error
    raise
from ._compare import Comparison, compare
from ._curve import Curve
from ._errors import Error, InputError, InternalError, NumericalError
from ._estimates import Estimate, Estimates, Verdict
from ._experiment import Experiment
from ._fit import Fit
from ._fit import open_run as open  # noqa: A001
from ._fleet import Row, RowList, Rows, fit_many, fit_partition, read_fleet
from ._functions import (
    BSpline,
    Constant,
    Fixed,
    Function,
    Nodal,
    PiecewiseConstant,
    PiecewiseLinear,
    Polynomial,
)
from ._model import Model, fit_model, init
from ._problem import Problem
from ._read import read_record
from ._study import Candidate, Extremes, Profile, Sensitivity, Study, StudyFinding

__version__: str = _kmcfit.version()

__all__ = [
    "BSpline",
    "Candidate",
    "Comparison",
    "Constant",
    "Curve",
    "Error",
    "Estimate",
    "Estimates",
    "Experiment",
    "Extremes",
    "Fit",
    "Fixed",
    "Function",
    "InputError",
    "InternalError",
    "Model",
    "Nodal",
    "NumericalError",
    "PiecewiseConstant",
    "PiecewiseLinear",
    "Polynomial",
    "Problem",
    "Profile",
    "Row",
    "RowList",
    "Rows",
    "Sensitivity",
    "Study",
    "StudyFinding",
    "Verdict",
    "compare",
    "fit_many",
    "fit_model",
    "fit_partition",
    "init",
    "open",
    "read",
    "read_fleet",
    "read_record",
]


def read(path: Any) -> Dict[str, Any]:
    """The columns of a data file (text, NumPy, MATLAB, HDF5, TDMS, WAV, UFF) as arrays by name, in the units of the file.

    ``km.Experiment(km.read("record.csv"), time="t_s", acceleration="a")`` uses them.
    """
    import os

    import numpy

    return {name: numpy.frombuffer(values).copy() for name, values in _kmcfit.read_table(os.fspath(path))}
