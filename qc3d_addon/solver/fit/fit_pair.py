# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fit of a pair of keys, done once for all its frames: the cube is filled and the fold-free map is fitted."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from ..arrays import Floats
from ..collision.self_crossings import CrossingLimit
from ..keys.checks import require_sizes
from ..keys.embedding import Embedding
from ..keys.keypair import KeyPair
from ..keys.orientation import require_reachable
from ..settings import FitOptions
from ..support.progress import Progress, Steps, staged, timed
from ..support.threads import ahead, beside
from ..surface.path import SurfacePath
from .continuation import follow_path, path_to
from .directions import half_turned_parts, path_between
from .fitted_map import FittedMap, crossing_limit
from .lattice import way_on_lattice
from .meeting import MET, meet_keys
from .own_crossings import crossing_vertices
from .volume import Volume, in_single_precision

# As a fraction of the diagonal. Real keys, including self-crossing ones, have residuals below a tenth of this.
_LARGE_RESIDUAL = 0.03
_MOST_NAMED = 10  # vertices


def fit_pair(pair: KeyPair, options: FitOptions, shared: Volume | None = None) -> Steps[FittedMap]:
    """Embed both keys, fill the cube and fit the fold-free map that carries the first key onto the second.

    Parameters
    ----------
    pair : KeyPair
    options : FitOptions
    shared : Volume, optional
        The volume around the first key, if it is known already. If the second key does not fit into its cube, the pair
        gets one of its own.

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
    require_sizes(pair.key0, pair.key1)
    out_of_reach = require_reachable(pair)
    seconds: dict[str, float] = {}
    embedding = None if shared is None else Embedding.of(pair, shared.cube)
    if embedding is None or shared is None or shared.cube is None or not shared.cube.holds(embedding):
        embedding, shared = Embedding.of(pair), None
    if options.quality == "exact":
        fitted = yield from _meeting(embedding, options, seconds)
    else:
        fitted = yield from _near(embedding, options, seconds, shared)
    notes = [*fitted.notes]
    turned = half_turned_parts(fitted.surface_path)
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
    if options.quality == "exact":
        notes += _missed_notes(fitted)
    return replace(fitted, notes=tuple(notes))


def _near(
    embedding: Embedding, options: FitOptions, seconds: dict[str, float], shared: Volume | None
) -> Steps[FittedMap]:
    """The map of a volume whose tetrahedra do not follow the vertices: it comes near the second key."""
    yield Progress("mesh", 0.0)
    with beside(partial(_way, embedding, options, seconds)) as way:
        with timed(seconds, "mesh"):
            volume = shared or Volume.filled(embedding, options)
        yield Progress("mesh", 1.0)
        yield Progress("locate", 0.0)
        with timed(seconds, "locate"):
            fitter = volume.fitter.anew()
        yield Progress("locate", 1.0)
        yield Progress("fit", 0.0)
        path, targets = way.result()
    with timed(seconds, "fit"), ahead(partial(_for_frames, embedding, path, volume)) as limit:
        followed = yield from staged("fit", follow_path(fitter, [in_single_precision(target) for target in targets]))
        followed = way_on_lattice(volume.mesh, followed)
    yield Progress("fit", 1.0)
    parts = (followed.maps, followed.turns, options, embedding, volume.notes, seconds, path)
    return FittedMap(embedding.pair, volume, *parts, None if limit is None else limit.result())


def _for_frames(embedding: Embedding, path: SurfacePath, volume: Volume) -> CrossingLimit:
    """What the frames will need, made while the fit keeps one core busy only; returns what the volume does not keep."""
    _ = volume.system, volume.around_landmarks
    return crossing_limit(embedding, path, volume)


def _meeting(embedding: Embedding, options: FitOptions, seconds: dict[str, float]) -> Steps[FittedMap]:
    """The map that meets the second key."""
    yield Progress("mesh", 0.0)
    with beside(partial(_way, embedding, options, seconds)) as way:
        with timed(seconds, "mesh"):
            volume = Volume.filled(embedding, options)
        yield Progress("mesh", 1.0)
        yield Progress("fit", 0.0)
        path, targets = way.result()
    with timed(seconds, "fit"):
        volume, followed = yield from staged("fit", meet_keys(embedding, volume, targets))
        followed = way_on_lattice(volume.mesh, followed)
    yield Progress("fit", 1.0)
    parts = (followed.maps, followed.turns, options, embedding, volume.notes, seconds, path)
    return FittedMap(embedding.pair, volume, *parts)


def _missed_notes(fitted: FittedMap) -> list[str]:
    """A sentence about the vertices that a map which is to meet the second key misses, where there are any."""
    missed = fitted.missed()
    worst = np.argsort(-missed, kind="stable")[: np.count_nonzero(missed > MET)]
    if not len(worst):
        return []
    crossing = np.count_nonzero(crossing_vertices(fitted.embedding)[worst])
    named = ", ".join(str(vertex) for vertex in worst[:_MOST_NAMED]) + (", …" if len(worst) > _MOST_NAMED else "")
    return [
        f"The map meets {len(missed) - len(worst)} of {len(missed)} vertices to {MET:.2%} of the size, and misses "
        f"{len(worst)}, {crossing} of them where a key crosses itself: {named}."
    ]


def _way(embedding: Embedding, options: FitOptions, seconds: dict[str, float]) -> tuple[SurfacePath, list[Floats]]:
    """The surface path to the second key, and the shapes along it that guide the map."""
    with timed(seconds, "path"):
        path = path_between(embedding, options)
        return path, path_to(path, embedding.key1)


def _parts(count: int) -> str:
    return "A part of the mesh is" if count == 1 else f"{count} parts of the mesh are"
