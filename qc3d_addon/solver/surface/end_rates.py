# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rates of rotation and stretch at the ends of a surface path, and how to change them without moving the ends.

The two cubic Hermite functions that vanish at both ends and have the slope 1 at one of them are added to the
interpolated quantities. This is how the pairs of a chain get the same rates at the key between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats
from ..numerics.rotations import rotation_matrices
from ..numerics.symmetric_matrices import Stretch
from ..settings import StretchLaw


def hermite(time: float, slope0: Floats, slope1: Floats) -> Floats:
    """Value at ``time`` of the cubic that vanishes at 0 and 1 and has the slopes ``slope0`` and ``slope1`` there.

    Examples
    --------
    >>> hermite(0.5, np.array([8.0]), np.array([0.0]))
    array([1.])
    """
    return np.asarray(time * (1.0 - time) ** 2 * slope0 + time**2 * (time - 1.0) * slope1)


@dataclass(frozen=True, eq=False)
class Rates:
    """Rates at one end of a path, per unit of its time, which runs from 0 to 1.

    Parameters
    ----------
    spin : (m, 3)
        Angular velocities of the triangles, radians.
    strain : (m, 2, 2)
        Symmetric in-plane strain rates, in the tangent bases of the triangles at that end.
    growth : (c,)
        Rates of the components' enclosed volumes, cubed cube units.
    """

    spin: Floats
    strain: Floats
    growth: Floats

    def toward(self, other: Rates) -> Rates:
        """The difference ``other`` - ``self``."""
        return Rates(other.spin - self.spin, other.strain - self.strain, other.growth - self.growth)


@dataclass(frozen=True, eq=False)
class EndCorrection:
    """Slopes added at the two ends of a path to its rotation vectors (m, 3), stretches (m, 2, 2) and volumes (c,)."""

    turns: tuple[Floats, Floats]
    stretches: tuple[Floats, Floats]
    volumes: tuple[Floats, Floats]


def rotation_vector_rates(vectors: Floats, spins: Floats) -> Floats:
    """(m, 3) time derivatives of rotation vectors, given the angular velocities of the rotations.

    Applies the inverse of the left Jacobian of the exponential map.

    Parameters
    ----------
    vectors : (m, 3)
        Rotation vectors with angles below 2 pi, radians.
    spins : (m, 3)
        Angular velocities in fixed axes, radians per unit of time.
    """
    angle = np.linalg.norm(vectors, axis=1)
    half = 0.5 * np.where(angle > 1e-4, angle, 1.0)
    second = np.where(angle > 1e-4, (1.0 - half / np.tan(half)) / (4.0 * half**2), 1.0 / 12.0)
    once = np.cross(vectors, spins)
    return np.asarray(spins - 0.5 * once + second[:, None] * np.cross(vectors, once))


def end_spins(swing: Floats, twist: Floats) -> tuple[Floats, Floats]:
    """(m, 3) angular velocities of exp(t swing) exp(t twist) at t = 0 and at t = 1."""
    turned = np.einsum("kij,kj->ki", rotation_matrices(swing), twist)
    return swing + twist, swing + turned


def stretch_slopes(stretch: Stretch, law: StretchLaw) -> tuple[Floats, Floats]:
    """(m, d, d) time derivatives of the interpolated stretch at t = 0 and at t = 1."""
    if law == "linear":
        slope = stretch.assembled(stretch.values - 1.0)
        return slope, slope
    logarithms = np.log(stretch.values)
    return stretch.assembled(logarithms), stretch.assembled(stretch.values * logarithms)


def strain_of_slope(stretch: Stretch, slope: Floats) -> Floats:
    """(m, d, d) strain rate of a stretch P with the time derivative ``slope``: the symmetric part of dP/dt P⁻¹."""
    rate = slope @ stretch.assembled(1.0 / stretch.values)
    return np.asarray(0.5 * (rate + rate.transpose(0, 2, 1)))


def slope_of_strain(stretch: Stretch, strain: Floats) -> Floats:
    """(m, d, d) symmetric dP/dt with the strain rate ``strain``: the inverse of ``strain_of_slope``."""
    vectors = stretch.vectors
    inverse = 1.0 / stretch.values
    within = vectors.transpose(0, 2, 1) @ strain @ vectors
    within = 2.0 * within / (inverse[:, :, None] + inverse[:, None, :])
    return np.asarray(vectors @ within @ vectors.transpose(0, 2, 1))
