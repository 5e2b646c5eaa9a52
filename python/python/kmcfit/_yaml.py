"""YAML text of a model: block maps and lists down to the innermost ones, which stand in one line."""

from __future__ import annotations

import json
import re
from typing import Any, List

_PLAIN = re.compile(r"[A-Za-z_][A-Za-z0-9_./ -]*")
_WORDS = {"true", "false", "null", "yes", "no", "on", "off", "y", "n"}
#: Longest map or list in one line.
_WIDTH = 100


def text(value: Any) -> str:
    """The YAML text of a map."""
    return "\n".join(_block(value, 0)) + "\n"


def _block(value: Any, depth: int) -> List[str]:
    pad = "  " * depth
    lines = []
    if isinstance(value, dict):
        for key, item in value.items():
            if _is_inner(item, len(pad) + len(str(key)) + 2):
                lines.append(f"{pad}{_scalar(str(key))}: {flow(item)}")
            else:
                lines.append(f"{pad}{_scalar(str(key))}:")
                lines += _block(item, depth + 1)
        return lines
    for item in value:
        if _is_inner(item, len(pad) + 2):
            lines.append(f"{pad}- {flow(item)}")
        else:
            first, *rest = _block(item, depth + 1)
            lines += [f"{pad}- {first[len(pad) + 2:]}", *rest]
    return lines


def _is_inner(value: Any, indent: int) -> bool:
    """True for a scalar, and for a map or list that is short, or has only numbers."""
    if not isinstance(value, (dict, list)) or not value:
        return True
    if isinstance(value, list) and all(isinstance(x, (int, float)) for x in value):
        return True
    items = value.values() if isinstance(value, dict) else value
    depth = max(_depth(item) for item in items)
    return depth < 2 and indent + len(flow(value)) <= _WIDTH


def _depth(value: Any) -> int:
    if not isinstance(value, (dict, list)):
        return 0
    items = value.values() if isinstance(value, dict) else value
    return 1 + max((_depth(item) for item in items), default=0)


def flow(value: Any) -> str:
    """A value in one line."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_scalar(str(k))}: {flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(flow, value)) + "]"
    return _scalar(value)


def _scalar(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        digits = repr(value)
        # YAML 1.1 reads a power of ten without a decimal point as a text.
        if "e" in digits and "." not in digits:
            digits = digits.replace("e", ".0e")
        return {"inf": ".inf", "-inf": "-.inf", "nan": ".nan"}.get(digits, digits)
    if isinstance(value, int):
        return str(value)
    word = str(value)
    plain = _PLAIN.fullmatch(word) and word.lower() not in _WORDS and not word.endswith(" ")
    return word if plain else json.dumps(word, ensure_ascii=False)
