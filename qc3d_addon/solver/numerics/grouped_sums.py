# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Sums and means of values grouped by integer labels, such as vertices by component or corners by vertex."""

from __future__ import annotations

import numpy as np

from ..arrays import Floats, Ints


def sums_by_label(labels: Ints, values: Floats, count: int = 0) -> Floats:
    """Sum of the values of each group.

    Parameters
    ----------
    labels : (n,) int64
        Group of each value: 0, 1, 2, ...
    values : (n,) or (n, c)
    count : int
        Least number of groups in the result; the sum of an empty group is 0.

    Returns
    -------
    (groups,) or (groups, c)

    Examples
    --------
    >>> sums_by_label(np.array([0, 2, 2]), np.array([1.0, 2.0, 3.0]))
    array([1., 0., 5.])
    """
    if values.ndim == 1:
        return np.bincount(labels, weights=values, minlength=count).astype(np.float64, copy=False)
    return np.stack([np.bincount(labels, weights=column, minlength=count) for column in values.T], axis=1)


def means_by_label(labels: Ints, values: Floats, weights: Floats | None = None, count: int = 0) -> Floats:
    """(groups, c) weighted mean of the rows of ``values`` (n, c) in each group; ``weights`` (n,) are 1 by default.

    The mean of an empty group, or of one whose weights are all zero, is 0.
    """
    weight = np.ones(len(labels)) if weights is None else weights
    total = np.maximum(sums_by_label(labels, weight, count), 1e-300)
    return np.asarray(sums_by_label(labels, weight[:, None] * values, count) / total[:, None])


def covariances_by_label(labels: Ints, first: Floats, second: Floats, count: int = 0) -> Floats:
    """(groups, 3, 3) sum, over each group, of the outer products first secondᵀ of rows (n, 3)."""
    products = (first[:, :, None] * second[:, None, :]).reshape(-1, 9)
    return sums_by_label(labels, products, count).reshape(-1, 3, 3)
