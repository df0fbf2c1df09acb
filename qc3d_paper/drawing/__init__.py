# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Drawing with matplotlib and numpy: shaded shapes, slices, histograms, contact sheets."""
