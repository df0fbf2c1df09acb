# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sentences about seams of mirrored halves that a key opens."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from ...solver.keys.keypair import Ends, KeyPair


def opened_seams(pairs: Mapping[Ends, KeyPair]) -> list[str]:
    """A sentence for each key that does not have vertices of the seam on a mirror plane where the key beside it has."""
    from ...solver.triangles.topology import open_loops

    sentences = []
    for names, pair in pairs.items():
        if not pair.planes:
            continue
        own = pair.own
        is_border = np.zeros(len(own.key0), dtype=bool)
        is_border[open_loops(own.faces)[0]] = True
        for plane in pair.planes:
            first, second = (np.abs(plane.heights(key)) <= plane.reach for key in (own.key0, own.key1))
            for on, off, there in ((*names, first & ~second), (*names[::-1], second & ~first)):
                count = int((there & is_border).sum())
                if count:
                    vertices, are = ("vertex", "is") if count == 1 else ("vertices", "are")
                    sentences.append(
                        f"{count} {vertices} of the seam {are} on the mirror plane in '{on}' but not in '{off}', where "
                        "the seam opens; move them onto the plane if it should stay shut."
                    )
    return list(dict.fromkeys(sentences))
