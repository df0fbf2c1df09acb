# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Energy density of maps, half a conformal and half a volume term, and its Gauss-Newton matrix on a tetrahedron."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Floats

VOLUME_SHARE = 0.5  # of the energy; the rest is the conformal term


@dataclass(frozen=True)
class Terms:
    """Energy density of each element and its derivatives; the stress is linear * J + slope * cof(J)."""

    density: Floats
    linear: Floats
    slope: Floats
    mixed: Floats
    curvature: Floats


def energy_density(squares: Floats, determinant: Floats) -> Floats:
    """(M,) the density, from |J|² (M,) and positive det J (M,); its minimum is 1, for rotations."""
    shape = (1.0 - VOLUME_SHARE) / 3.0 * squares * determinant ** (-2.0 / 3.0)
    return np.asarray(shape + 0.5 * VOLUME_SHARE * (determinant + 1.0 / determinant))


def derivatives(squares: Floats, determinant: Floats) -> Terms:
    """The density and its first and second derivatives with respect to |J|² and det J."""
    shape = (1.0 - VOLUME_SHARE) / 3.0 * determinant ** (-2.0 / 3.0)
    shape_slope = -2.0 / 3.0 * shape / determinant
    shape_curvature = -5.0 / 3.0 * shape_slope / determinant
    slope = squares * shape_slope + 0.5 * VOLUME_SHARE * (1.0 - determinant**-2)
    curvature = squares * shape_curvature + VOLUME_SHARE * determinant**-3
    return Terms(energy_density(squares, determinant), 2.0 * shape, slope, 2.0 * shape_slope, curvature)


def projected_blocks(
    volumes: Floats, gradients: Floats, jacobians: Floats, cofactor: Floats, squares: Floats, terms: Terms
) -> Floats:
    """(M, 4, 4, 3, 3) positive semi-definite element blocks of the Gauss-Newton matrix.

    With det J linearized, the Hessian is linear * I + mixed (J Cᵀ + C Jᵀ) + curvature C Cᵀ on the span of J and its
    cofactor matrix C, and a multiple of the identity on the complement. The 2 x 2 part is projected in closed form.
    """
    norm = np.sqrt(np.maximum(squares, 1e-300))
    first = jacobians / norm[:, None, None]
    along = np.einsum("mij,mij->m", cofactor, first)
    second = cofactor - along[:, None, None] * first
    across = np.sqrt(np.einsum("mij,mij->m", second, second))
    second /= np.maximum(across, 1e-300)[:, None, None]
    top = 2.0 * terms.mixed * norm * along + terms.curvature * along**2
    corner = terms.mixed * norm * across + terms.curvature * along * across
    bottom = terms.curvature * across**2
    top, corner, bottom = _projected_2x2(terms.linear, top, corner, bottom)
    # The factors are the gradients contracted with the two directions. All blocks of a tetrahedron are computed by one
    # small matrix product.
    factors = np.stack([gradients @ first.transpose(0, 2, 1), gradients @ second.transpose(0, 2, 1)], axis=3)
    factors = factors.reshape(-1, 12, 2)
    mixed = volumes[:, None, None] * np.stack([top, corner, corner, bottom], axis=1).reshape(-1, 2, 2)
    rows = (factors @ mixed) @ factors.transpose(0, 2, 1)
    blocks = np.ascontiguousarray(rows.reshape(-1, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4))
    laplacian = (volumes * terms.linear)[:, None, None] * (gradients @ gradients.transpose(0, 2, 1))
    for axis in range(3):
        blocks[..., axis, axis] += laplacian
    return blocks


def _projected_2x2(
    shift: Floats, top: Floats, corner: Floats, bottom: Floats
) -> tuple[Floats, Floats, Floats]:
    """Clamp the eigenvalues of shift * I + [[top, corner], [corner, bottom]] to at least 1 % of shift."""
    mean, half = 0.5 * (top + bottom), 0.5 * (top - bottom)
    radius = np.hypot(half, corner)
    floor = -0.99 * shift
    high, low = np.maximum(mean + radius, floor), np.maximum(mean - radius, floor)
    mean, stretch = 0.5 * (high + low), 0.5 * (high - low) / np.maximum(radius, 1e-300)
    return mean + stretch * half, stretch * corner, mean - stretch * half
