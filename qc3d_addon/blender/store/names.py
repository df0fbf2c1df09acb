# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of generated shape keys and sliders, within Blender's limit of 63 bytes."""

from __future__ import annotations

from collections.abc import Container, Sequence

LIMIT = 63
MAX_STEPS = 999
ARROW = "→"
ELLIPSIS = "…"

# Room after a label for the longest fraction, " 999/999", and for the ".001" that Blender adds to a name in use.
_AFTER_LABEL = len(f" {MAX_STEPS}/{MAX_STEPS}") + len(".001")
_LEAST_ROOM = 9  # bytes of a name that still tell keys apart; with less for each, only the first and the last are named


def chain_label(keys: Sequence[str], taken: Container[str]) -> str:
    """The name of the slider that goes through two keys or more, and the start of the names of its shape keys.

    It reads "first→second→third". Long names lose their middle, because variants of one name usually differ at an end;
    where there are too many keys the inner ones become "…"; a label that is taken gets a number in brackets.
    """
    number = 1
    while True:
        mark = "" if number == 1 else f" ({number})"
        label = _join(keys, LIMIT - _AFTER_LABEL - len(mark)) + mark
        if label not in taken:
            return label
        number += 1


def key_name(label: str, step: int, intervals: int) -> str:
    """The name of the shape key at ``step`` of ``intervals``: "A→B 1/4" for the first of three in-betweens."""
    return f"{label} {step}/{intervals}"


def _join(keys: Sequence[str], room: int) -> str:
    if _size(ARROW.join(keys)) > room and room // len(keys) < _LEAST_ROOM + _size(ARROW):
        keys = [keys[0], ELLIPSIS, keys[-1]]
    room -= (len(keys) - 1) * _size(ARROW)
    parts = list(keys)
    # Short names keep what they need; the longer ones share the rest.
    for left, index in enumerate(sorted(range(len(keys)), key=lambda number: _size(keys[number]))):
        parts[index] = _shorten(keys[index], room // (len(keys) - left))
        room -= _size(parts[index])
    return ARROW.join(parts)


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
