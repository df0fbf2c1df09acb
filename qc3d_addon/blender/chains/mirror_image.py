# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Mirrors shapes of an object whose Basis is at least nearly symmetric across x = 0."""

from __future__ import annotations

from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...solver.errors import InputError
from ..kinds import keys_of, mesh_of
from ..store.mesh_data import key_coordinates

# Of all vertices: where more have no mirror image the mesh is not symmetric.
_MOST_LOST = 0.1
# Of the largest coordinate: places that differ by a few roundings are the same.
_ROUNDING = 4.0 * float(np.finfo(np.float32).eps)


@dataclass(frozen=True, eq=False)
class MirrorImage:
    """The mirror partners of an object's vertices.

    Parameters
    ----------
    rest : (n, 3)
        The Basis.
    partners : (n,)
        For each vertex its partner, or the vertex nearest to its mirror image.
    has_partner : (n,)
        Whether a vertex has a partner.
    """

    rest: NDArray[np.float32]
    partners: NDArray[np.int64]
    has_partner: NDArray[np.bool_]

    def of(self, shape: NDArray[np.float32]) -> NDArray[np.float32]:
        """A shape (n, 3) mirrored: every vertex moves to the mirror image of its partner.

        This is exact if the two are mirror images in the Basis, up to rounding; otherwise their offsets are mirrored.
        """
        flipped = np.array([-1.0, 1.0, 1.0], dtype=np.float32)
        apart = np.abs(self.rest[self.partners] * flipped - self.rest).max(axis=1)
        is_exact = (apart <= _ROUNDING * np.abs(self.rest).max()) & self.has_partner
        moved = self.rest + (shape[self.partners] - self.rest[self.partners]) * flipped
        return np.where(is_exact[:, None], shape[self.partners] * flipped, moved)

    def note(self) -> list[str]:
        """A sentence about vertices without a partner, if there are any."""
        lost = int((~self.has_partner).sum())
        if not lost:
            return []
        return [
            f"{lost} of {len(self.partners)} vertices have no mirror image across x = 0; they move as what is nearest "
            "there does. Topology finds those that the mesh's polygons tell."
        ]


def mirror_image(obj: bpy.types.Object, use_topology: bool) -> MirrorImage:
    """The mirror partners of an object's vertices in its Basis.

    Parameters
    ----------
    use_topology
        Whether vertices without a partner at their mirrored position are matched by the topology around known partners.

    Raises
    ------
    InputError
        If too many vertices have no partner.
    """
    from scipy.spatial import cKDTree

    from ...solver.triangles.mirror_symmetry import known_partners, likely_partners
    from ...solver.triangles.mirror_topology import topology_partners

    mesh = mesh_of(obj)
    reference = keys_of(obj).reference_key
    rest = key_coordinates(obj, reference.name)
    ends = np.empty(2 * len(mesh.edges), dtype=np.int32)
    mesh.edges.foreach_get("vertices", ends)
    places, edges = rest.astype(np.float64), ends.reshape(-1, 2).astype(np.int64)
    partners = known_partners(places, edges)
    if use_topology:
        partners = likely_partners(places, edges, partners)
        corners = np.empty(len(mesh.loops), dtype=np.int32)
        mesh.loops.foreach_get("vertex_index", corners)
        starts = np.empty(len(mesh.polygons), dtype=np.int32)
        mesh.polygons.foreach_get("loop_start", starts)
        partners = topology_partners(
            corners.astype(np.int64), np.append(starts, len(corners)).astype(np.int64), partners
        )
    has_partner = partners >= 0
    lost = np.flatnonzero(~has_partner)
    if len(lost) > _MOST_LOST * len(rest):
        remedy = "make the Basis symmetric with Mesh > Snap to Symmetry in Edit Mode"
        remedy += "" if use_topology else ", or choose Topology"
        raise InputError(f"{len(lost)} of {len(rest)} vertices have no mirror image across x = 0; {remedy}.")
    partners[lost] = cKDTree(rest).query(rest[lost] * [-1.0, 1.0, 1.0])[1]
    return MirrorImage(rest, partners, has_partner)
