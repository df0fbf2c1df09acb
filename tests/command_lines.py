# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Command lines for tests."""

from __future__ import annotations

from collections.abc import Sequence


def with_others(command: Sequence[str], others: Sequence[str]) -> list[str]:
    """A command line with other options, in place of its own of the same names, which have one value each."""
    kept: list[str] = []
    words = iter(command)
    for word in words:
        if word.startswith("--") and word in others and word != "--via":
            next(words)
        else:
            kept.append(word)
    return [*kept, *others]
