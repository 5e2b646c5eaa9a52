"""Models: coefficient functions with the settings of a fit."""

from __future__ import annotations

import json
import operator
import os
import threading
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

from . import _kmcfit, _yaml
from ._errors import InputError, unknown_keyword
from ._experiment import Experiment
from ._fit import Fit
from ._functions import lowered, plain
from ._problem import Problem
from ._study import Study

#: Coefficient functions.
COEFFICIENTS = tuple(_kmcfit.coefficient_names())
_UNKNOWN_MASS = {"fixed": "unknown"}
_FROM_RECORD = {"basis": "constant"}
#: Fit settings of `kmcfit init`.
_FIT = {"method": "gauss-newton", "stop": {"iterations": 100, "tolerance": 1e-8}}
#: Path of a model that has no file, for messages.
_PATH = "model.yaml"

Overrides = Mapping[str, Any]
Progress = Callable[[int, float], object]


class Model:
    """A model: mass, damping and stiffness, and the settings of its fit. Arguments have the names of the model file.

    Parameters
    ----------
    mass, damping, stiffness : float, Constant, Polynomial, PiecewiseLinear, BSpline, Nodal, Fixed or dict, optional
        Coefficient functions, kg, N s/m and N/m; a number is a fixed value. Without a mass it is a constant, estimated, for records of
        which one has a force; for others it is unknown, and the other coefficients are ratios to it. Damping and stiffness are constants by
        default, estimated from the record.
    **functions : optional
        Further coefficient functions by their names in a model file: ``cubic_stiffness``, ``quadratic_damping``, ``coulomb_friction``, ...
    constraints : list of dict, optional
        Linear constraints, e.g. ``[{"function": "mass", "shape": "non-increasing"}]``.
    grid : dict, optional
        ``{"nodes": 2000, "method": "midpoint"}``; chosen from the records by default.
    fit : dict, optional
        Method, start and stopping tests; those of ``kmcfit init`` by default.
    title : str, optional
        Title for reports.
    truth, predict, study : optional
        As in the model file.

    Examples
    --------
    >>> import kmcfit as km
    >>> km.Model(mass=2.4, damping=km.Constant(start=1.0), stiffness=km.BSpline(start=1500.0, min=0.0))
    <Model mass, damping, stiffness>
    """

    def __init__(
        self,
        mass: Any = None,
        damping: Any = None,
        stiffness: Any = None,
        *,
        constraints: Optional[List[Dict[str, Any]]] = None,
        grid: Optional[Dict[str, Any]] = None,
        fit: Optional[Dict[str, Any]] = None,
        title: Optional[str] = None,
        truth: Optional[Dict[str, Any]] = None,
        predict: Optional[List[Dict[str, Any]]] = None,
        study: Optional[Dict[str, Any]] = None,
        **functions: Any,
    ) -> None:
        for word in functions:
            if word not in COEFFICIENTS:
                known = [*COEFFICIENTS, "constraints", "grid", "fit", "title", "truth", "predict", "study"]
                raise unknown_keyword("Model", word, known)
        given = {
            "mass": _UNKNOWN_MASS if mass is None else mass,
            "damping": _FROM_RECORD if damping is None else damping,
            "stiffness": _FROM_RECORD if stiffness is None else stiffness,
            **functions,
        }
        spec = {
            "format": 1,
            "title": title,
            "experiments": [],
            "grid": plain(grid),
            "functions": {name: lowered(value) for name, value in given.items() if value is not None},
            "constraints": plain(constraints),
            "fit": plain(_FIT if fit is None else fit),
            "truth": plain(truth),
            "predict": plain(predict),
            "study": plain(study),
        }
        self._spec: Dict[str, Any] = {key: value for key, value in spec.items() if value is not None}
        self._path = _PATH
        self._chooses_mass = mass is None
        self._last: Optional[_Ready] = None
        # Keys and types are checked at once; numbers with the records.
        placeholder = {"initial": "estimate"}
        _kmcfit.parse(_yaml.text({**self._spec, "experiments": [placeholder]}), _PATH, False)

    @classmethod
    def from_yaml(cls, source: Union[str, "os.PathLike[str]"]) -> "Model":
        """The model of a file, or of a text (with a line end) in the format of the model file.

        Experiments with their data files are part of the model; paths in a file are relative to its folder.
        """
        given = os.fspath(source)
        is_text = "\n" in given
        path = _PATH if is_text else given
        model = cls.__new__(cls)
        model._spec = json.loads(_kmcfit.parse(given if is_text else _kmcfit.read_text(path), path, True))
        model._path = path
        model._chooses_mass = False
        model._last = None
        return model

    def to_yaml(self, *data: Experiment) -> str:
        """The model as the text of a model file.

        Parameters
        ----------
        *data : Experiment
            Records; their arrays stand in files of the names that the text has, see `save`.
        """
        return self._with(data)[0]

    def save(self, path: Union[str, "os.PathLike[str]"], *data: Experiment) -> None:
        """Writes the model file, and beside it one ``.npz`` for each record. Existing files are refused.

        ``kmcfit fit`` on the file and `fit` give the same results.
        """
        target = Path(path)
        text, files = self._with(data)
        contents = {target: text.encode(), **{target.parent / name: content for name, content in files.items()}}
        for file in contents:
            if file.exists():
                raise InputError("the file exists already", str(file), expected="another name")
        for file, content in contents.items():
            file.write_bytes(content)

    def fit(
        self,
        *data: Experiment,
        set: Optional[Overrides] = None,  # noqa: A002
        progress: Optional[Progress] = None,
        select: bool = False,
    ) -> Fit:
        """Fits the model to records.

        The interpreter is free for other threads meanwhile. Ctrl-C ends the fit at the best point so far, with the status
        ``"interrupted"``; a second one raises `KeyboardInterrupt`.

        Parameters
        ----------
        *data : Experiment
            Records of one system on a common time axis; without any the experiments of the model file.
        set : dict, optional
            Changed keys, e.g. ``{"fit.stop.iterations": 50}``.
        progress : callable, optional
            Called with the number and the cost of each iteration, from another thread; its exception ends the fit, and is raised.
        select : bool
            Adds the candidate that is preferred to the model, fits, and asks again, until none is preferred: at most five.

        Returns
        -------
        Fit

        Raises
        ------
        InputError
            If model or records are invalid.
        NumericalError
            If no starting point has a response.
        """
        return Fit._of(_kmcfit.fit(self._ready(data, overrides(set)), select, progress, _is_main_thread()))

    def study(
        self,
        *data: Experiment,
        set: Optional[Overrides] = None,  # noqa: A002
        progress: Optional[Progress] = None,
        **options: Any,
    ) -> Study:
        """Fits the model to records and studies the fit, as ``kmcfit study`` does; `options` are those of `Fit.study`."""
        return self.fit(*data, set=set, progress=progress).study(**options)

    def problem(self, *data: Experiment, set: Optional[Overrides] = None) -> Problem:  # noqa: A002
        """The cost and its derivatives as functions of the parameters, for other optimisers; arguments as for `fit`."""
        return Problem(_kmcfit.Problem(self._ready(data, overrides(set))))

    def __repr__(self) -> str:
        return f"<Model {', '.join(self._spec['functions'])}>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and (self._spec, self._path) == (other._spec, other._path)

    __hash__ = None  # type: ignore[assignment]

    def __getstate__(self) -> Dict[str, Any]:
        return {"_spec": self._spec, "_path": self._path, "_chooses_mass": self._chooses_mass}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        self.__dict__.update(state, _last=None)

    def _ready(self, data: Tuple[Experiment, ...], changes: List[str]) -> "_kmcfit.RawModel":
        """The parsed model with its records; that of the last call is kept for the next one, whose records may be others."""
        last = self._last
        if last is not None and last.changes == changes and len(last.data) == len(data):
            if all(map(operator.is_, last.data, data)):
                return last.raw
            if all(map(_is_alike, last.data, data)):
                files = {f"record-{i}.npz": experiment._file() for i, experiment in enumerate(data, 1)}
                self._last = last._replace(data=data, raw=last.raw.with_files(files))
                return self._last.raw
        text, files = self._with(data)
        path = os.path.join(os.path.dirname(self._path), _PATH) if files else self._path
        raw = _kmcfit.RawModel(text, path, files, changes)
        # Files on disk may change between two calls.
        self._last = _Ready(data, changes, raw) if data else None
        return raw

    def _with(self, data: Tuple[Experiment, ...]) -> Tuple[str, Dict[str, bytes]]:
        """The text with the experiments of `data`, and their files."""
        if not data:
            if not self._spec["experiments"]:
                raise InputError("no experiment", "Model.fit", "no records", "at least one `Experiment`")
            return _yaml.text(self._spec), {}
        experiments, files = [], {}
        for i, experiment in enumerate(data, 1):
            if not isinstance(experiment, Experiment):
                found = type(experiment).__name__
                raise InputError(
                    "not an experiment", f"record {i}", found, "an `Experiment`", "wrap arrays: `km.Experiment(time=t, …)`"
                )
            file = f"record-{i}.npz"
            files[file] = experiment._file()
            name = {} if experiment.name is None else {"name": experiment.name}
            experiments.append({**name, "data": file, **experiment._spec})
        spec = {**self._spec, "experiments": experiments}
        if self._chooses_mass and any(experiment.has_force for experiment in data):
            # A force determines the mass.
            spec["functions"] = {**spec["functions"], "mass": _FROM_RECORD}
        return _yaml.text(spec), files


class _Ready(NamedTuple):
    """The parsed model of a call."""

    data: Tuple[Experiment, ...]
    changes: List[str]
    raw: "_kmcfit.RawModel"


def _is_alike(one: Experiment, other: Any) -> bool:
    """True if the records have the same text in a model."""
    return isinstance(other, Experiment) and (one._spec, one.name, one.has_force) == (other._spec, other.name, other.has_force)


def _is_main_thread() -> bool:
    return threading.current_thread() is threading.main_thread()


def overrides(changes: Optional[Overrides]) -> List[str]:
    """Changed keys as the texts of ``--set``."""
    return [f"{key}={_yaml.flow(plain(value))}" for key, value in (changes or {}).items()]


def fit_model(
    path: Union[str, "os.PathLike[str]"],
    set: Optional[Overrides] = None,  # noqa: A002
    progress: Optional[Progress] = None,
    select: bool = False,
) -> Fit:
    """Fits the model of a file, as ``kmcfit fit`` does, with the same results. See `Model.fit`."""
    raw = _kmcfit.RawModel(None, os.fspath(path), {}, overrides(set))
    return Fit._of(_kmcfit.fit(raw, select, progress, _is_main_thread()))


def init(*paths: Union[str, "os.PathLike[str]"]) -> Model:
    """A model for measured records, as ``kmcfit init`` writes it; paths in it are those given.

    `Model.to_yaml` shows it.
    """
    return Model.from_yaml(_kmcfit.scaffold([os.fspath(path) for path in paths]))
