# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What the way from tetrahedra to vertices and back costs by itself: no mode is left out, nothing is rounded."""

from __future__ import annotations

import numpy as np
from scipy.sparse import diags_array
from scipy.sparse.linalg import lsqr

from ..errors import ReconstructionError
from ..maps.boundary_conditions import Conditions
from ..maps.mapping import Mapping
from ..maps.reconstruction import reconstruct
from ..maps.representation import from_upper_triangle, upper_triangle
from .compressed import Scheme
from .logarithms import exponential, logarithm
from .modes import Transfer

_ITERATIONS = 300


def transferred(mapping: Mapping, scheme: Scheme, conditions: Conditions) -> Mapping | None:
    """The map rebuilt from its representation after the transfer of a scheme.

    ``published`` and ``logarithm`` average over the tetrahedra around a vertex; ``fitted`` takes the values at the
    vertices whose means over corners come nearest. None where what comes back is not positive definite.
    """
    mesh, transfer = mapping.mesh, Transfer(mapping.mesh)
    channels = upper_triangle(mapping.stretch if scheme == "published" else logarithm(mapping.stretch))
    if scheme == "fitted":
        weights = np.sqrt(mesh.volumes)
        matrix = diags_array(weights) @ transfer.to_tets
        columns = [lsqr(matrix, weights * channel, iter_lim=_ITERATIONS)[0] for channel in channels.T]
        at_vertices = np.stack(columns, axis=1)
    else:
        at_vertices = np.asarray(transfer.to_vertices @ channels)
    matrices = from_upper_triangle(np.asarray(transfer.to_tets @ at_vertices))
    try:
        return reconstruct(mesh, matrices if scheme == "published" else exponential(matrices), conditions)
    except ReconstructionError:
        return None
