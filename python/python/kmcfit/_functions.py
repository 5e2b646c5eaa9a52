"""Coefficient functions of a model: one class for each basis of the model file."""

from __future__ import annotations

import functools
import inspect
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Dict, Optional, Sequence, Union

import numpy as np

from ._errors import unknown_keyword

Values = Union[float, Sequence[float], Dict[str, Any]]


def checked(cls: type) -> type:
    """The class with an `InputError` with the near spelling for an unknown keyword."""
    init = cls.__init__  # type: ignore[misc]
    names = [name for name in inspect.signature(init).parameters if name != "self"]

    @functools.wraps(init)
    def __init__(self: Any, *args: Any, **keywords: Any) -> None:
        for word in keywords:
            if word not in names:
                raise unknown_keyword(cls.__name__, word, names)
        init(self, *args, **keywords)

    cls.__init__ = __init__  # type: ignore[misc]
    return cls


def plain(value: Any) -> Any:
    """Arrays and scalars of NumPy as lists and numbers of Python; maps and lists element by element."""
    if isinstance(value, np.ndarray) or hasattr(value, "to_numpy"):
        return np.asarray(value).tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


@dataclass(frozen=True)
class Function:
    """A coefficient function; the fields have the names and meanings of the model file.

    Parameters
    ----------
    start : float, sequence or dict, optional
        Start values of the search in the SI unit of the function: one number, or one per parameter. Without them a mass,
        damping or stiffness starts from the record.
    min, max : float or "none", optional
        Bounds.
    penalty : dict or list of dict, optional
        Penalty on the roughness, e.g. ``{"kind": "tikhonov", "order": 2, "weight": "reml"}``.
    known_part : float, sequence or dict, optional
        Known values added to the estimated function.
    width : float, optional
        For Coulomb friction: velocity over which its sign is smoothed, m/s.
    """

    basis: ClassVar[str] = ""
    start: Optional[Values] = None
    min: Union[float, str, None] = None
    max: Union[float, str, None] = None
    penalty: Union[Dict[str, Any], Sequence[Dict[str, Any]], None] = None
    known_part: Optional[Values] = None
    width: Union[float, str, None] = None

    def to_dict(self) -> Dict[str, Any]:
        """The map of the model file."""
        given = {field.name: plain(getattr(self, field.name)) for field in fields(self)}
        return {"basis": self.basis, **{key: value for key, value in given.items() if value is not None}}


@checked
@dataclass(frozen=True)
class Constant(Function):
    """One constant."""

    basis: ClassVar[str] = "constant"


@checked
@dataclass(frozen=True)
class Polynomial(Function):
    """A polynomial of `degree` over the whole record."""

    basis: ClassVar[str] = "polynomial"
    degree: int = 1


@checked
@dataclass(frozen=True)
class PiecewiseLinear(Function):
    """One value per knot, linear in between; `knots` is their number, their times (s), or ``"auto"``."""

    basis: ClassVar[str] = "piecewise-linear"
    knots: Union[int, str, Sequence[float]] = "auto"


@checked
@dataclass(frozen=True)
class PiecewiseConstant(Function):
    """One value per interval between `knots`: their number or their times (s)."""

    basis: ClassVar[str] = "piecewise-constant"
    knots: Union[int, str, Sequence[float]] = 2


@checked
@dataclass(frozen=True)
class BSpline(Function):
    """A cubic B-spline; `knots` is their number, their times (s), or ``"auto"``."""

    basis: ClassVar[str] = "b-spline"
    knots: Union[int, str, Sequence[float]] = "auto"


@checked
@dataclass(frozen=True)
class Nodal(Function):
    """One parameter per node of the grid."""

    basis: ClassVar[str] = "nodal"


@checked
@dataclass(frozen=True)
class Fixed:
    """Fixed values, with a standard deviation that enters all intervals if `sigma` is given.

    Parameters
    ----------
    value : float, sequence, dict or "unknown"
        In the SI unit of the function; ``"unknown"`` for a mass that nothing determines.
    sigma : float, optional
        Standard deviation of the value.
    """

    value: Any
    sigma: Optional[float] = None

    def to_dict(self) -> Dict[str, Any]:
        """The map of the model file."""
        value = plain(self.value)
        return {"fixed": value if self.sigma is None else {"value": value, "sigma": plain(self.sigma)}}


def lowered(value: Any) -> Any:
    """A function as a map of the model file: a class of this module, a map, or fixed numbers."""
    if isinstance(value, (Function, Fixed)):
        return value.to_dict()
    value = plain(value)
    return value if isinstance(value, dict) else {"fixed": value}
