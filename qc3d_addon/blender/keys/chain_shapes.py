# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The shapes of a chain: those that its keys store, and those that its control shows at each step."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import QC3DError
from ..kinds import keys_of, mesh_of
from ..store.chain import Chain
from ..store.mesh_data import key_coordinates, shown_coordinates
from .chain_keys import all_owned_keys, base_key


def shapes_by_step(
    obj: bpy.types.Object, met: dict[int, str], frames: NDArray[np.float64]
) -> dict[int, NDArray[np.float32]]:
    """The shapes that a chain with a slider needs keys for: all frames except the Basis, which shows without any key.

    Parameters
    ----------
    met
        Names of the user's own keys, by the step that shows them.
    frames
        (k, n, 3) positions from the first key to the last.

    Returns
    -------
    (n, 3) float32 positions by step, the user's keys bit for bit.

    Raises
    ------
    QC3DError
        If the frames are not finite positions of the mesh's vertices.
    """
    shapes = dict(enumerate(_rounded(obj, frames)))
    for step, name in met.items():
        if name == keys_of(obj).reference_key.name:
            del shapes[step]
        else:
            shapes[step] = shown_coordinates(obj, name)
    return shapes


def offsets_by_step(
    obj: bpy.types.Object, places: tuple[float, ...], frames: NDArray[np.float64]
) -> dict[int, NDArray[np.float32]]:
    """The shapes that a chain played by a key's value needs: at each inner step, the frame minus the straight blend.

    Parameters
    ----------
    places
        Places of the steps, as values of the key.
    frames
        (k, n, 3) positions at these steps, from the key's base to the key itself.

    Returns
    -------
    dict
        (n, 3) float32 absolute positions by step, for keys with the same base as that key.

    Raises
    ------
    QC3DError
        If the frames are not finite positions of the mesh's vertices.
    """
    at = np.array(places)[:, None, None]
    offsets = _rounded(obj, frames - at * (frames[-1] - frames[0]))
    return {step: offsets[step] for step in range(1, len(places) - 1)}


def step_shapes(obj: bpy.types.Object, chain: Chain) -> NDArray[np.float64]:
    """(k, n, 3) positions that a chain's control shows at each of its steps, including what was sculpted since.

    Raises
    ------
    InputError
        If keys of the chain are missing.
    """
    keys = keys_of(obj)
    owned = all_owned_keys(keys, chain)
    first = key_coordinates(obj, base_key(keys, chain).name).astype(np.float64)
    # What the key itself adds if its own value plays the chain.
    whole = shown_coordinates(obj, chain.on_key) - first if chain.on_key else np.zeros_like(first)
    return np.stack(
        [
            (key_coordinates(obj, owned[step].name) if step in owned else first) + place * whole
            for step, place in enumerate(chain.places)
        ]
    )


def _rounded(obj: bpy.types.Object, frames: NDArray[np.float64]) -> NDArray[np.float32]:
    """Frames (k, n, 3) in single precision, as shape keys store them; raises QC3DError if that is impossible."""
    if frames.ndim != 3 or frames.shape[1:] != (len(mesh_of(obj).vertices), 3):
        raise QC3DError(
            f"The in-betweens have shape {frames.shape} for {len(mesh_of(obj).vertices)} vertices; please report this."
        )
    with np.errstate(over="ignore"):  # too large values become infinite and are refused below
        rounded = frames.astype(np.float32)
    if not np.isfinite(rounded).all():
        raise QC3DError("An in-between has coordinates that are not finite; try another quality or engine.")
    return np.asarray(rounded)
