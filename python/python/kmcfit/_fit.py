"""Fits: estimates, curves over time, verdict, and the files of a run."""

from __future__ import annotations

import html
import json
import os
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import _kmcfit, _npz, _table, _yaml
from ._arrays import column
from ._curve import Curve
from ._errors import InputError, did_you_mean
from ._estimates import Estimates, Verdict, texts
from ._functions import plain
from ._page import Drawing, first_screen, read_files, write_files
from ._study import Study

#: Quantities over time in `functions.csv`.
_CURVES = (*_kmcfit.coefficient_names(), "k_over_m", "c_over_m", "natural_frequency", "damping_ratio")


class Fit:
    """A fit of a model: the results of ``kmcfit fit``. Made by `Model.fit`, `fit_model` and `open`.

    Attributes
    ----------
    estimates : Estimates
        Quantity, estimate, 95 % interval, unit, status.
    verdict : Verdict
    warnings : list of str
    result : dict
        The document ``result.json``.
    mass, damping, stiffness, k_over_m, natural_frequency, damping_ratio, … : Curve
        Coefficients and ratios over time.
    """

    _raw: Optional["_kmcfit.RawFit"]
    _files: Optional[Dict[str, bytes]]
    #: Folder of an opened run.
    _folder: Optional[str] = None

    def __init__(self) -> None:
        raise TypeError("a Fit is made by `Model.fit`, `fit_model` or `open`")

    @classmethod
    def _of(cls, raw: "_kmcfit.RawFit") -> "Fit":
        fit = cls.__new__(cls)
        fit.__dict__.update(_raw=raw, _files=None, _cache={})
        if raw.is_interrupted():
            import warnings

            warnings.warn("the fit was interrupted; the best point so far is returned", RuntimeWarning, stacklevel=4)
        return fit

    @classmethod
    def _opened(cls, text: str, folder: str) -> "Fit":
        fit = cls.__new__(cls)
        fit.__dict__.update(_raw=None, _files=read_files(folder), _folder=os.path.abspath(folder), _cache={"json": text})
        return fit

    # Documents.

    @property
    def result(self) -> Dict[str, Any]:
        """The document ``result.json``; see the chapter on results."""
        return self._once("result", lambda: json.loads(self._document()))

    @property
    def status(self) -> str:
        """End of the fit: converged, completed, max-iterations, time-limit, stalled, interrupted, infeasible or failed."""
        return self.result["outcome"]["status"]

    @property
    def cost(self) -> float:
        """Cost J at the estimates."""
        return self.result["cost"]["final"]

    @property
    def estimates(self) -> Estimates:
        """Table of estimates."""
        return self._once("estimates", lambda: Estimates(self.result))

    @property
    def verdict(self) -> Verdict:
        """Verdict on the fit."""
        return Verdict(self.result.get("verdict") or {})

    @property
    def warnings(self) -> List[str]:
        """Warnings about data, model and identifiability."""
        findings = self.result.get("findings", [])
        return texts(self.result.get("warnings")) + texts([f for f in findings if f.get("level", "note") != "note"])

    @property
    def parameters(self) -> Dict[str, float]:
        """Estimated parameters by name, SI."""
        document = self._parameters()
        return dict(zip(document["names"], document["values"]))

    @property
    def covariance(self) -> Optional["np.ndarray"]:
        """Covariance of the parameters in their order, or None."""
        found = self._parameters().get("covariance")
        return None if found is None else np.array(found)

    @property
    def functions(self) -> Dict[str, "np.ndarray"]:
        """Columns of ``functions.csv``: coefficients, ratios and their intervals over time."""
        return self._once("functions", lambda: _table.columns(self._text("functions.csv")))

    @property
    def trajectory(self) -> Dict[str, "np.ndarray"]:
        """Columns of ``trajectory.csv``: the simulated response over time."""
        return self._once("trajectory", lambda: _table.columns(self._text("trajectory.csv")))

    @property
    def history(self) -> Dict[str, "np.ndarray"]:
        """Columns of ``history.csv``: one row per iteration."""
        return self._once("history", lambda: _table.columns(self._text("history.csv")))

    def curve(self, name: str) -> Curve:
        """A quantity over time by its name: ``"stiffness"``, ``"k_over_m"``, ``"natural_frequency"``, …"""
        names = self._curve_names()
        if name not in names:
            known = list(names)
            raise InputError("no such quantity", "Fit.curve", f"`{name}`", "one of: " + ", ".join(known), did_you_mean(name, known))
        header = names[name]
        table = self.functions
        ends = table.get(header + "_lo95"), table.get(header + "_hi95")
        band = None if ends[0] is None or np.isnan(ends[0]).all() else ends
        unit = self.estimates[name].unit if any(e.quantity == name for e in self.estimates) else ""
        return Curve(name, unit, table["t_s"], table[header], band)

    def __getattr__(self, name: str) -> Curve:
        if name in _CURVES and "_cache" in self.__dict__:
            if name in self._curve_names():
                return self.curve(name)
            raise AttributeError(f"the model has no {name}")
        raise AttributeError(f"'Fit' object has no attribute '{name}'")

    def __dir__(self) -> List[str]:
        return [*super().__dir__(), *self._curve_names()]

    # Use.

    def simulate(
        self,
        *,
        time: Any = None,
        force: Any = None,
        base_acceleration: Any = None,
        base_displacement: Any = None,
        initial: Sequence[float] = (0.0, 0.0),
        channels: Union[str, Sequence[str]] = "displacement",
    ) -> Dict[str, "np.ndarray"]:
        """The response of the fitted system to another input, as ``kmcfit predict`` computes it.

        Parameters
        ----------
        time : array_like, shape (n,)
            Times of the input, s.
        force, base_acceleration, base_displacement : array_like, shape (n,), optional
            Inputs in SI units; none for a free response over the times of the fit.
        initial : (displacement, velocity)
            Initial state, m and m/s.
        channels : str or sequence of str
            ``displacement``, ``velocity``, ``acceleration``.

        Returns
        -------
        dict of ndarray
            Columns of ``predictions.csv``: times, and each channel with its interval where the run has one.
        """
        inputs = {"force": force, "base_acceleration": base_acceleration, "base_displacement": base_displacement}
        units = {"force": "N", "base_acceleration": "m/s^2", "base_displacement": "m"}
        given = {name: column(f"Fit.simulate.{name}", value) for name, value in inputs.items() if value is not None}
        if given and time is None:
            raise InputError("no times", "Fit.simulate.time", expected="times of the input, s")
        wanted = [channels] if isinstance(channels, str) else list(channels)
        state = [float(x) for x in initial]
        if len(state) != 2:
            raise InputError("invalid initial state", "Fit.simulate.initial", repr(initial), "(displacement, velocity)")
        with temporary_folder() as folder:
            run = os.path.join(folder, "run")
            self._write(run)
            paths: Dict[str, Optional[str]] = {"force": None, "base": None}
            for name, values in given.items():
                times = column("Fit.simulate.time", time)
                if len(times) != len(values):
                    found = f"{len(values)} samples"
                    raise InputError("unequal lengths", f"Fit.simulate.{name}", found, f"{len(times)} samples, as `time`")
                path = os.path.join(folder, name + ".npz")
                Path(path).write_bytes(_npz.archive({"time [s]": times, f"{name} [{units[name]}]": values}))
                paths["force" if name == "force" else "base"] = path
            return _table.columns(_kmcfit.simulate(run, paths["force"], paths["base"], (state[0], state[1]), wanted))

    def save(
        self, folder: Union[str, "os.PathLike[str]"], *, report: bool = True, tables: bool = False
    ) -> None:
        """Writes the run into a folder: the files of ``kmcfit fit --out FOLDER``.

        For a model of arrays the folder also has ``model.yaml`` and the records, so that ``kmcfit verify`` can recompute the results.

        Parameters
        ----------
        folder : path
            A new folder, or one with results of kmcfit, which are replaced.
        report : bool
            With figures and page.
        tables : bool
            A row for every node in the tables over time.
        """
        if self._raw is not None:
            self._raw.save(os.fspath(folder), report, tables)
            return
        write_files(folder, self._files or {})

    def study(
        self,
        *,
        threads: Optional[int] = None,
        **keys: Any,
    ) -> Study:
        """Analyses what the records determine, as ``kmcfit study`` does: identified directions, profiles, extremes, candidates.

        Further arguments are the keys of ``study`` in the model file, such as ``starts=5`` or ``extremes=[1.0, 2.0]``; those that are not
        given have the values of the model, or its defaults. Ctrl-C ends the study after the analyses finished so far, with the status
        ``"interrupted"``.

        Parameters
        ----------
        threads : int
            Number of threads, one per core if not given; results do not depend on it.

        Returns
        -------
        Study
        """
        if threads is not None and (isinstance(threads, bool) or not isinstance(threads, int) or threads < 1):
            raise InputError("invalid number of threads", "Fit.study.threads", repr(threads), "1 or more")
        changes = [f"study.{key}={_yaml.flow(plain(value))}" for key, value in keys.items() if value is not None]
        with temporary_folder() as folder:
            out = os.path.join(folder, "study")
            if self._raw is not None:
                findings, text, is_interrupted = _kmcfit.study(self._raw, out, changes, threads)
            else:
                run = self._folder or os.path.join(folder, "run")
                if not os.path.isdir(run):
                    write_files(run, self._files or {})
                findings, text, is_interrupted = _kmcfit.study_run(run, out, changes, threads)
            if is_interrupted:
                import warnings

                warnings.warn("the study was interrupted; it has the analyses finished so far", RuntimeWarning, stacklevel=2)
            return Study(findings, text, read_files(out))

    def plot(self, figure: str = "functions") -> Drawing:
        """A figure of the run, by default the coefficients with their 95 % bands; others are `ratios`, `channel`, `residuals`, ...

        Raises
        ------
        InputError
            If the run has no such figure.
        """
        files = self._run()
        drawing = files.get(f"figures/{figure}.svg")
        if drawing is None:
            names = [name[8:-4] for name in files if name.startswith("figures/")]
            raise InputError("no such figure", "Fit.plot", repr(figure), "one of: " + ", ".join(names))
        return Drawing(drawing.decode())

    def to_pandas(self) -> Any:
        """Curves over time as a DataFrame of pandas, indexed by the time in s."""
        import pandas  # type: ignore[import-untyped,unused-ignore]

        return pandas.DataFrame(self.functions).set_index("t_s")

    # Display.

    def __repr__(self) -> str:
        title = self.result["title"]
        return f"<Fit {title!r}: {self.status}>\n{self.verdict}\n{self.estimates!r}"

    def _repr_html_(self) -> str:
        page = self._run().get("report.html")
        if page is not None:
            return first_screen(page.decode())
        title = f"<h4>{html.escape(self.result['title'])}: {html.escape(self.status)}</h4>"
        return f"{title}<p>{html.escape(str(self.verdict))}</p>{self.estimates._repr_html_()}"

    def __getstate__(self) -> Dict[str, Any]:
        return {"json": self._document(), "files": self._run()}

    def __setstate__(self, state: Dict[str, Any]) -> None:
        self.__dict__.update(_raw=None, _files=state["files"], _cache={"json": state["json"]})

    # Parts.

    def _once(self, name: str, make: Any) -> Any:
        cache = self.__dict__["_cache"]
        if name not in cache:
            cache[name] = make()
        return cache[name]

    def _run(self) -> Dict[str, bytes]:
        """All files of the run by name."""
        if self._files is None:
            with temporary_folder() as folder:
                run = os.path.join(folder, "run")
                self._write(run, report=True)
                return self._once("run", lambda: read_files(run))
        return self._files

    def _write(self, folder: str, report: bool = False) -> None:
        if self._raw is None:
            self.save(folder)
        else:
            self._raw.save(folder, report, not report)

    def _text(self, name: str) -> str:
        if self._files is not None:
            return self._files[name].decode()
        return self._once("tables", lambda: dict(self._raw.tables()) if self._raw else {})[name]

    def _document(self) -> str:
        """The text of the result document."""
        return self._once("json", lambda: self._raw.json() if self._raw else "{}")

    def _parameters(self) -> Dict[str, Any]:
        return self._once("parameters", lambda: json.loads(self._text("parameters.json")))

    def _curve_names(self) -> Dict[str, str]:
        """Headers of the values by quantity."""
        found: Dict[str, str] = {}
        for header in self.functions:
            names = [name for name in _CURVES if header == name or header.startswith(name + "_")]
            if names and not header.endswith(("_lo95", "_hi95")) and " of " not in header:
                found.setdefault(max(names, key=len), header)
        return found


def open_run(folder: Union[str, "os.PathLike[str]"]) -> Fit:
    """A finished run from the folder that ``kmcfit fit`` or `Fit.save` wrote."""
    path = os.fspath(folder)
    return Fit._opened(_kmcfit.open_run(path), path)


def temporary_folder() -> Any:
    """A folder that its context removes. The module is slow to import, and used for few calls."""
    from tempfile import TemporaryDirectory

    return TemporaryDirectory()
