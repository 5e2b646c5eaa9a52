"""The table of estimates of a fit, and the verdict on it."""

from __future__ import annotations

import html
from typing import Any, Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

from ._errors import InputError, did_you_mean


class Estimate(NamedTuple):
    """One estimate; of a function over time its mean."""

    quantity: str
    #: Value in `unit`.
    value: Optional[float]
    #: 95 % confidence interval, or None.
    ci95: Optional[Tuple[float, float]]
    #: Smallest and largest value over the record.
    range: Optional[Tuple[float, float]]
    unit: str
    #: ``estimated``, ``fixed``, ``only_as_ratio``, …
    status: str


class Estimates:
    """Estimates in the order of importance: a sequence, and a map from quantities such as ``"natural_frequency"``."""

    def __init__(self, result: dict) -> None:
        self._rows: List[Estimate] = [
            Estimate(
                name,
                given.get("value"),
                _pair(given.get("ci95")),
                _pair(given.get("range")),
                given.get("unit", ""),
                given.get("status", ""),
            )
            for name, given in result.get("estimates", {}).items()
        ]

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[Estimate]:
        return iter(self._rows)

    def __getitem__(self, key: Union[int, str]) -> Estimate:
        if isinstance(key, int):
            return self._rows[key]
        names = [row.quantity for row in self._rows]
        if key not in names:
            raise InputError("no such estimate", "estimates", f"`{key}`", "one of: " + ", ".join(names), did_you_mean(key, names))
        return self._rows[names.index(key)]

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Estimates) and self._rows == other._rows

    def __repr__(self) -> str:
        rows = [("quantity", "estimate", "95 % CI", "unit", "status"), *map(_row, self._rows)]
        width = [max(len(row[i]) for row in rows) for i in range(5)]
        line = "{:<%d}  {:>%d}  {:<%d}  {:<%d}  {}" % tuple(width[:4])
        return "\n".join(line.format(*row).rstrip() for row in rows)

    def _repr_html_(self) -> str:
        head = "".join(f"<th>{name}</th>" for name in ("quantity", "estimate", "95 % CI", "unit", "status"))
        cell = "<td>{}</td>".format
        rows = ("".join(cell(html.escape(text)) for text in _row(row)) for row in self._rows)
        return f"<table><thead><tr>{head}</tr></thead><tbody>" + "".join(f"<tr>{row}</tr>" for row in rows) + "</tbody></table>"

    def to_pandas(self) -> Any:
        """The table as a DataFrame of pandas, indexed by the quantity; the interval in `low` and `high`."""
        import pandas  # type: ignore[import-untyped,unused-ignore]

        rows = [
            (row.quantity, row.value, *(row.ci95 or (None, None)), *(row.range or (None, None)), row.unit, row.status)
            for row in self._rows
        ]
        names = ["quantity", "value", "low", "high", "min", "max", "unit", "status"]
        return pandas.DataFrame(rows, columns=names).set_index("quantity")


def _pair(given: Optional[list]) -> Optional[Tuple[float, float]]:
    return None if given is None else (given[0], given[1])


def _row(row: Estimate) -> Tuple[str, str, str, str, str]:
    value = "" if row.value is None else f"{row.value:.6g}"
    interval = "" if row.ci95 is None else f"{row.ci95[0]:.6g} to {row.ci95[1]:.6g}"
    return row.quantity, value, interval, row.unit, row.status.replace("_", " ")


class Verdict:
    """Verdict on a fit.

    Attributes
    ----------
    level : {"adequate", "check", "inadequate"}
    reasons : list of str
        Reasons, the most important first; none for adequate.
    assumptions : list of str
        Assumptions that the records cannot test.
    """

    def __init__(self, given: Mapping[str, Any]) -> None:
        self.level: str = given.get("level", "")
        self.reasons: List[str] = texts(given.get("reasons"))
        self.passed: str = given.get("passed", "")
        self.assumptions: List[str] = texts(given.get("assumptions"))

    def __str__(self) -> str:
        return "; ".join([self.level.capitalize(), *(self.reasons or filter(None, [self.passed]))])

    def __repr__(self) -> str:
        return f"<Verdict {self}>"


def texts(findings: Any) -> List[str]:
    """The sentences of findings."""
    return [finding["text"] for finding in findings or []]
