"""Studies: what the records determine."""

from __future__ import annotations

import json
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np

from ._page import first_screen, write_files


class StudyFinding(NamedTuple):
    """A finding of a study."""

    #: Part of the study: ``bands``, ``profiles``, ``extremes``, ``candidates``, …
    part: str
    text: str


class Sensitivity(NamedTuple):
    """Identified combinations of the parameters, from the scaled sensitivity of the samples."""

    #: Number of identifiable combinations, of all `combinations`.
    rank: int
    combinations: int
    #: All singular values, largest first.
    singular_values: "np.ndarray"
    #: Name of the ambiguity that each unidentifiable combination belongs to, and its share within it.
    unidentifiable: List[Tuple[str, float]]


class Profile(NamedTuple):
    """Likelihood profile of one quantity."""

    name: str
    unit: str
    optimum: float
    #: Values of the quantity, and the least cost at each.
    values: "np.ndarray"
    costs: "np.ndarray"
    #: Ends of the confidence interval; None where the profile has none.
    interval: Tuple[Optional[float], Optional[float]]
    #: ``identified``, ``one-sided`` or ``flat``.
    verdict: str
    text: str


class Extremes(NamedTuple):
    """Smallest and largest value of a quantity among all systems that are consistent with the data."""

    name: str
    unit: str
    #: Times, s.
    times: "np.ndarray"
    low: "np.ndarray"
    high: "np.ndarray"
    #: Largest misfit that counts as consistent.
    misfit_limit: float


class Candidate(NamedTuple):
    """A candidate experiment."""

    name: str
    #: Combinations of parameters that it makes identifiable; None if it cannot be simulated.
    added_rank: Optional[int]
    #: Ratio of the geometric mean of the standard errors with the experiment to that without.
    d_ratio: Optional[float]
    text: str


class Study:
    """A study of a fit: the results of ``kmcfit study``. Made by `Fit.study` and `Model.study`.

    Attributes
    ----------
    result : dict
        The document ``study.json``; see the chapter on results.
    findings : list of StudyFinding
        The findings as sentences, in the order of the page.
    status : {"complete", "interrupted"}
    """

    def __init__(self, findings: List[Tuple[str, str]], text: str, files: Mapping[str, bytes]) -> None:
        self._files = dict(files)
        self._text = text
        self.findings = [StudyFinding(*finding) for finding in findings]
        self.result: Dict[str, Any] = json.loads(self._files["study.json"])

    @property
    def status(self) -> str:
        """``complete``, or ``interrupted`` before all analyses were finished."""
        return self.result["status"]

    @property
    def sensitivity(self) -> Optional[Sensitivity]:
        """Identified combinations of the parameters; None in a study that was interrupted before."""
        given = self.result["sensitivity"]
        if given is None:
            return None

        return Sensitivity(
            given["rank"],
            given["combinations"],
            np.array(given["singular_values"]),
            [(one["name"], one["share"]) for one in given["unidentifiable"]],
        )

    @property
    def classification(self) -> Dict[str, str]:
        """``identified``, ``only-ratio``, ``partly-identified``, ``not-identified`` or ``fixed`` for each function and ratio."""
        return {one["name"]: one["verdict"] for one in (self.result["bands"] or {}).get("classification", [])}

    @property
    def profiles(self) -> Dict[str, Profile]:
        """Likelihood profiles by quantity."""
        return {
            one["name"]: Profile(
                one["name"],
                one["unit"],
                one["optimum"],
                np.array(one["values"]),
                np.array(one["costs"]),
                (one["interval"][0], one["interval"][1]),
                one["verdict"],
                one["text"],
            )
            for one in self.result["profiles"]
        }

    @property
    def extremes(self) -> Dict[str, Extremes]:
        """Data-consistent extremes by function or ratio."""
        return {
            one["name"]: Extremes(
                one["name"],
                one["unit"],
                np.array(one["times"]),
                np.array(one["low"]),
                np.array(one["high"]),
                one["misfit_limit"],
            )
            for one in self.result["extremes"]
        }

    @property
    def candidates(self) -> List[Candidate]:
        """Candidate experiments, the most informative first."""
        return [Candidate(*(one[name] for name in Candidate._fields)) for one in self.result["candidates"]]

    @property
    def html(self) -> str:
        """The page of the study, one HTML file without external resources."""
        return self._files["study.html"].decode()

    def save(self, folder: Union[str, "os.PathLike[str]"]) -> None:
        """Writes the files of ``kmcfit study --out FOLDER`` into a new folder."""
        write_files(folder, self._files)

    def __repr__(self) -> str:
        return self._text

    def _repr_html_(self) -> str:
        return first_screen(self.html)
