# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of generated shape keys and sliders, within Blender's limit of 63 bytes."""

from __future__ import annotations

from collections.abc import Container, Sequence

LIMIT = 63
MAX_STEPS = 999
# Only ASCII letters and underscores: easy to type, and valid in files that allow only letters, digits and underscores.
BETWEEN = "_to_"
LEFT_OUT = "__"

# Room after a label for the longest place, and for the ".001" that Blender adds to a name in use.
_AFTER_LABEL = len("_99_9") + len(".001")
_LEAST_ROOM = 9  # bytes per name; with less, shortened names look alike, so only the first and the last key are named


def chain_label(keys: Sequence[str], taken: Container[str], mark: str = "") -> str:
    """The name of the slider for two or more keys, which is also the start of the names of its shape keys.

    It has the form "first_to_second_to_third". Long names are shortened in their middle, because variants of a name
    usually differ at an end; with too many keys, the inner ones become "__"; a label in use gets a number.
    ``mark`` is appended.
    """
    number = 1
    while True:
        marks = mark if number == 1 else f"{mark}_v{number}"
        label = _join(keys, LIMIT - _AFTER_LABEL - len(marks)) + marks
        if label not in taken:
            return label
        number += 1


def key_name(label: str, step: int, places: Sequence[float]) -> str:
    """The name of the shape key at a step, with its place in percent: "Smile_25" for the first of three in-betweens.

    If two places have the same percentage, it has tenths of a percent too: "Smile_33_3".
    """
    if len({round(100.0 * place) for place in places}) == len(places):
        return f"{label}_{round(100.0 * places[step]):02d}"
    whole, tenths = divmod(round(1000.0 * places[step]), 10)
    return f"{label}_{whole:02d}_{tenths}"


def combination_name(keys: Sequence[str], places: Sequence[float]) -> str:
    """The name of the shape key that corrects keys that are on at once, by their values: "Jaw_Smile_50_100"."""
    ending = "".join(f"_{round(100.0 * place)}" for place in places)
    room = LIMIT - len(".001") - _size(ending) - (len(keys) - 1)
    parts = [_shorten(key, room // len(keys)) for key in keys]
    return "_".join(parts) + ending


def _join(keys: Sequence[str], room: int) -> str:
    if _size(BETWEEN.join(keys)) > room and room // len(keys) < _LEAST_ROOM + _size(BETWEEN):
        keys = [keys[0], LEFT_OUT, keys[-1]]
    room -= (len(keys) - 1) * _size(BETWEEN)
    parts = list(keys)
    # Short names keep what they need; the longer ones share the rest.
    for left, index in enumerate(sorted(range(len(keys)), key=lambda number: _size(keys[number]))):
        parts[index] = _shorten(keys[index], room // (len(keys) - left))
        room -= _size(parts[index])
    return BETWEEN.join(parts)


def _shorten(name: str, room: int) -> str:
    if _size(name) <= room:
        return name
    raw = name.encode()
    kept = room - _size(LEFT_OUT)
    head, tail = raw[: (kept + 1) // 2], raw[len(raw) - kept // 2 :]
    # A character cut in two at either edge is left out whole.
    return head.decode(errors="ignore") + LEFT_OUT + tail.decode(errors="ignore")


def _size(text: str) -> int:
    return len(text.encode())
