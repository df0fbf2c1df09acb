# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums and means of values that carry labels: of vertices by component, of corners by vertex."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints


def sums_by_label(labels: Ints, values: Floats, count: int = 0) -> Floats:
    """Sums of the values that carry each label.

    Parameters
    ----------
    labels : (n,) int64
        0, 1, 2, ...
    values : (n,) or (n, c)
    count : int
        How many labels there are at least; those that nothing carries have the sum 0.

    Returns
    -------
    (labels,) or (labels, c)

    Examples
    --------
    >>> sums_by_label(np.array([0, 2, 2]), np.array([1.0, 2.0, 3.0]))
    array([1., 0., 5.])
    """
    if values.ndim == 1:
        return np.bincount(labels, weights=values, minlength=count).astype(np.float64, copy=False)
    return np.stack([np.bincount(labels, weights=column, minlength=count) for column in values.T], axis=1)


def means_by_label(labels: Ints, values: Floats, weights: Floats | None = None, count: int = 0) -> Floats:
    """(labels, c) means of the rows of ``values`` (n, c) that carry each label, weighted by ``weights`` (n,).

    Zero where nothing carries a label, or its weights add up to nothing.
    """
    weight = np.ones(len(labels)) if weights is None else weights
    total = np.maximum(sums_by_label(labels, weight, count), 1e-300)
    return np.asarray(sums_by_label(labels, weight[:, None] * values, count) / total[:, None])


def covariances_by_label(labels: Ints, first: Floats, second: Floats, count: int = 0) -> Floats:
    """(labels, 3, 3) sums of the outer products first secondᵀ of the rows (n, 3) that carry each label."""
    products = (first[:, :, None] * second[:, None, :]).reshape(-1, 9)
    return sums_by_label(labels, products, count).reshape(-1, 3, 3)
