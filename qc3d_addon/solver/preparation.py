# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The part of a bake that is done once for two keys: the cube filled, the fold-free map fitted."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from .continuation import follow_path, path_to
from .embedding import Embedding
from .foldfree import FoldFreeFitter
from .keypair import KeyPair
from .location import interpolation_matrix
from .meshing import fill_cube
from .orientation import require_reachable
from .parallel import beside
from .prepared import PreparedMap
from .progress import Progress, Steps, staged, timed
from .settings import Settings
from .surface_path import SurfacePath
from .tetmesh import Floats

# Landmarks of real keys, self-crossing ones included, are missed by less than a tenth of this part of their size.
_LARGE_RESIDUAL = 0.03


def prepare(pair: KeyPair, settings: Settings) -> Steps[PreparedMap]:
    """Embed both keys, fill the cube and fit the fold-free map that carries the first key onto the second.

    Raises
    ------
    InputError
        If more than half of the second key is mirrored, turned inside out or crossed by itself, which no map without
        folds reaches.
    MeshingError
        If the engine asked for cannot fill the cube.

    Notes
    -----
    Where only parts of the mesh are out of reach the map stays as near as it can, a note says so, and the surface meets
    both keys all the same.
    """
    out_of_reach = require_reachable(pair)
    seconds: dict[str, float] = {}
    embedding = Embedding.of(pair)
    yield Progress("mesh", 0.0)
    with beside(partial(_way, embedding, settings, seconds)) as way:
        with timed(seconds, "mesh"):
            filled = fill_cube(embedding.key0, pair.faces, settings)
        yield Progress("mesh", 1.0)
        yield Progress("locate", 0.0)
        with timed(seconds, "locate"):
            landmarks = interpolation_matrix(filled.mesh, embedding.key0)
        yield Progress("locate", 1.0)
        yield Progress("fit", 0.0)
        path, targets = way.result()
    with timed(seconds, "fit"):
        fitter = FoldFreeFitter(filled.mesh, landmarks, embedding.weights)
        followed = yield from staged("fit", follow_path(fitter, targets))
    yield Progress("fit", 1.0)
    prepared = PreparedMap(
        pair,
        filled.mesh,
        followed.maps,
        followed.turns,
        settings.extra_turns,
        filled.engine,
        settings.quality,
        filled.notes,
        seconds,
        {settings.stretch: path},
    )
    notes = []
    missed = prepared.landmark_residual()["rms"]
    if out_of_reach.parts:
        notes.append(
            f"{_parts(out_of_reach.parts)} mirrored or turned inside out between the keys: no motion of a volume "
            "does that, and the mode straight may look no worse."
        )
    elif missed > _LARGE_RESIDUAL:
        notes.append(
            f"The map misses the second key by {missed:.0%} of its size: no map without folds comes nearer to what the "
            "second key crosses or flattens, and the mode straight may look no worse."
        )
    if pair.far_away is not None:
        notes.append(pair.far_away)
    return replace(prepared, notes=(*filled.notes, *notes))


def _way(embedding: Embedding, settings: Settings, seconds: dict[str, float]) -> tuple[SurfacePath, list[Floats]]:
    """The surface's own path to the second key, and the shapes on it that lead the map."""
    with timed(seconds, "path"):
        path = SurfacePath(embedding, settings.stretch, settings.extra_turns != 0)
        return path, path_to(path, embedding.key1)


def _parts(count: int) -> str:
    return "A part of the mesh is" if count == 1 else f"{count} parts of the mesh are"
