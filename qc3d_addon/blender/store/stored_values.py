# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Checks of stored values: a .blend file comes from anywhere, and any script may have changed it.

Every function returns the value if it is valid, and raises ValueError otherwise.
"""

from __future__ import annotations

import json
import math
from typing import Any, NoReturn

from .names import LIMIT

LONGEST_TEXT = 10_000


def parse(text: object) -> dict[str, Any]:
    """The JSON object in the string of a custom property."""
    if not isinstance(text, str):
        raise ValueError("not a text")
    try:
        value = json.loads(text, parse_constant=_refuse)
    except RecursionError as error:
        raise ValueError("nested too deep") from error
    return plain_dict(value)


def plain_dict(value: object) -> dict[str, Any]:
    """A dictionary with any contents."""
    if not isinstance(value, dict):
        raise ValueError("not a dictionary")
    return value


def plain_list(value: object) -> list[Any]:
    """A list with any contents."""
    if not isinstance(value, list):
        raise ValueError("not a list")
    return value


def whole(value: object, low: int, high: int) -> int:
    """An int from ``low`` to ``high``, and no bool."""
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise ValueError(f"not a whole number from {low} to {high}")
    return value


def number(value: object, low: float = -math.inf, high: float = math.inf) -> float:
    """A finite number from ``low`` to ``high``."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("not a number")
    try:
        result = float(value)
    except OverflowError as error:
        raise ValueError("too large a number") from error
    if not math.isfinite(result) or not low <= result <= high:
        raise ValueError(f"not a number from {low} to {high}")
    return result


def text(value: object, most: int = LONGEST_TEXT) -> str:
    """A string of at most ``most`` bytes that Blender accepts: valid UTF-8 without null characters."""
    if not isinstance(value, str) or "\0" in value:
        raise ValueError("not a text")
    if len(value.encode()) > most:  # raises UnicodeEncodeError, a ValueError, for half a surrogate pair
        raise ValueError("too long a text")
    return value


def name(value: object, most: int = LIMIT) -> str:
    """The name of a shape key or a custom property, of at most ``most`` bytes."""
    if not text(value, most):
        raise ValueError("an empty name")
    return str(value)


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a number")
