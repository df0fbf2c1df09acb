# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Fills the unit cube with tetrahedra, finest near the surface: two engines behind one function."""
