# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of generated shape keys and sliders, within Blender's limit of 63 bytes."""

from __future__ import annotations

from collections.abc import Container

LIMIT = 63
MAX_INBETWEENS = 200
ARROW = "→"
ELLIPSIS = "…"

# Room after a label for the longest fraction, " 201/201", and for the ".001" that Blender adds to a name in use.
_AFTER_LABEL = len(f" {MAX_INBETWEENS + 1}/{MAX_INBETWEENS + 1}") + len(".001")


def chain_label(first: str, second: str, taken: Container[str]) -> str:
    """The name of the slider from one key to another, and the start of the names of its shape keys.

    It reads "first→second". Long names lose their middle, because variants of one name usually differ at an end; a
    label that is taken gets a number in brackets.
    """
    number = 1
    while True:
        mark = "" if number == 1 else f" ({number})"
        label = _join(first, second, LIMIT - _AFTER_LABEL - len(mark)) + mark
        if label not in taken:
            return label
        number += 1


def key_name(label: str, step: int, intervals: int) -> str:
    """The name of the shape key at ``step`` of ``intervals``: "A→B 1/4" for the first of three in-betweens."""
    return f"{label} {step}/{intervals}"


def _join(first: str, second: str, room: int) -> str:
    room -= _size(ARROW)
    # The shorter name keeps what it needs; the longer one gets the rest.
    first_room = max(room // 2, room - _size(second))
    first = _shorten(first, first_room)
    return first + ARROW + _shorten(second, room - _size(first))


def _shorten(name: str, room: int) -> str:
    if _size(name) <= room:
        return name
    raw = name.encode()
    kept = room - _size(ELLIPSIS)
    head, tail = raw[: (kept + 1) // 2], raw[len(raw) - kept // 2 :]
    # A character cut in two at either edge is left out whole.
    return head.decode(errors="ignore") + ELLIPSIS + tail.decode(errors="ignore")


def _size(text: str) -> int:
    return len(text.encode())
