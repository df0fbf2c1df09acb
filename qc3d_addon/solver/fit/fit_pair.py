# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit of a pair of keys, done once for all its frames: the cube is filled and the fold-free map is fitted."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import Floats
from ..keys.embedding import Embedding
from ..keys.keypair import KeyPair, require_sizes
from ..keys.orientation import require_reachable
from ..meshing.cube import fill_cube
from ..settings import FitOptions
from ..support.progress import Progress, Steps, staged, timed
from ..support.threads import beside
from ..surface.path import SurfacePath
from ..tets.point_location import interpolation_matrix
from .continuation import follow_path, path_to
from .directions import half_turned_parts, path_between
from .fitted_map import FittedMap
from .fold_free import FoldFreeFitter

# As a fraction of the diagonal. Real keys, including self-crossing ones, have residuals below a tenth of this.
_LARGE_RESIDUAL = 0.03


def fit_pair(pair: KeyPair, options: FitOptions) -> Steps[FittedMap]:
    """Embed both keys, fill the cube and fit the fold-free map that carries the first key onto the second.

    Parameters
    ----------
    pair : KeyPair
    options : FitOptions

    Raises
    ------
    InputError
        If more than half of the second key is mirrored, turned inside out or tangled, which no fold-free map can reach,
        or if the keys are too large, too small, or of too different sizes.
    MeshingError
        If the chosen engine cannot fill the cube.

    Notes
    -----
    If only parts of the mesh cannot be reached, the map stays as close as it can and a note says so; in-betweens meet
    both keys all the same.
    """
    require_sizes(pair)
    out_of_reach = require_reachable(pair)
    seconds: dict[str, float] = {}
    embedding = Embedding.of(pair)
    yield Progress("mesh", 0.0)
    with beside(partial(_way, embedding, options, seconds)) as way:
        with timed(seconds, "mesh"):
            filled = fill_cube(in_single_precision(embedding.key0), pair.faces, options)
        yield Progress("mesh", 1.0)
        yield Progress("locate", 0.0)
        with timed(seconds, "locate"):
            landmarks = interpolation_matrix(filled.mesh, embedding.key0)
            coarse = interpolation_matrix(filled.mesh, in_single_precision(embedding.key0))
        yield Progress("locate", 1.0)
        yield Progress("fit", 0.0)
        path, targets = way.result()
    with timed(seconds, "fit"):
        fitter = FoldFreeFitter(filled.mesh, coarse, in_single_precision(embedding.weights))
        followed = yield from staged("fit", follow_path(fitter, targets))
    yield Progress("fit", 1.0)
    fitted = FittedMap(
        pair,
        filled.mesh,
        followed.maps,
        followed.turns,
        options,
        filled.engine,
        embedding,
        landmarks,
        filled.notes,
        seconds,
        path,
    )
    notes = [*filled.notes]
    turned = half_turned_parts(path)
    missed = fitted.landmark_residual().rms
    if out_of_reach.parts:
        notes.append(
            f"{_parts(out_of_reach.parts)} mirrored or turned inside out between the keys{out_of_reach.where}, which "
            "no motion of a volume can do. Mode straight may look as good."
        )
    elif missed > _LARGE_RESIDUAL:
        other = " Where a part goes the wrong way round, choose other extra turns." if turned else ""
        notes.append(
            f"The map misses the second key by {missed:.0%} of its size: no map without folds can come closer where "
            f"the second key crosses itself or is flattened. Mode straight may look as good.{other}"
        )
    if turned and not options.extra_turns:
        notes.append(
            f"{'A part turns' if turned == 1 else f'{turned} parts turn'} by half a turn, for which both ways are as "
            "long; -1 as extra turns takes the other way."
        )
    return replace(fitted, notes=tuple(notes))


def _way(embedding: Embedding, options: FitOptions, seconds: dict[str, float]) -> tuple[SurfacePath, list[Floats]]:
    """The surface path to the second key, and the shapes along it that guide the map."""
    with timed(seconds, "path"):
        path = path_between(embedding, options)
        return path, path_to(path, in_single_precision(embedding.key1))


def _parts(count: int) -> str:
    return "A part of the mesh is" if count == 1 else f"{count} parts of the mesh are"


def in_single_precision(values: Floats) -> Floats:
    """Values rounded to single precision.

    A fit takes a few hundred steps, each of which makes differences grow. What differs by rounding only, such as keys
    that were moved, must lead to the same map.
    """
    return np.asarray(values, dtype=np.float32).astype(np.float64)
