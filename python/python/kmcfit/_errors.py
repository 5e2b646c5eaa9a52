"""Exceptions of kmcfit."""

from __future__ import annotations

from typing import Iterable, Optional


class Error(Exception):
    """Base of all exceptions of kmcfit."""


class InputError(Error, ValueError):
    """Invalid input: an argument, a model, a file or an array.

    Attributes
    ----------
    problem : str
        The problem, as a sentence without a full stop.
    where : str
        Place: an argument, a key of the model, or a file with line or sample.
    found, expected, hint : str or None
        The value found, the accepted values, and a remedy.
    """

    def __init__(
        self,
        problem: str,
        where: str = "",
        found: Optional[str] = None,
        expected: Optional[str] = None,
        hint: Optional[str] = None,
    ) -> None:
        super().__init__(problem, where, found, expected, hint)
        self.problem = problem
        self.where = where
        self.found = found
        self.expected = expected
        self.hint = hint

    def __str__(self) -> str:
        lines = [f"{self.where}: {self.problem}" if self.where else self.problem]
        for label in ("found", "expected", "hint"):
            text = getattr(self, label)
            if text is not None:
                lines.append(f"  {label}: {text}")
        return "\n".join(lines)


class NumericalError(Error, ArithmeticError):
    """A computation without a result, such as parameters without a finite response."""


class InternalError(Error, RuntimeError):
    """A defect of kmcfit: a panic in Rust. The interpreter continues."""


def did_you_mean(word: str, words: Iterable[str]) -> Optional[str]:
    """The nearest spelling among `words`, as a remedy."""
    import difflib

    near = difflib.get_close_matches(word, list(words), n=1, cutoff=0.6)
    return f"did you mean `{near[0]}`?" if near else None


def unknown_keyword(where: str, word: str, words: Iterable[str]) -> InputError:
    """The error for a keyword that is not among `words`."""
    words = list(words)
    return InputError(
        "unknown keyword",
        where=where,
        found=f"`{word}`",
        expected="one of: " + ", ".join(words),
        hint=did_you_mean(word, words),
    )
