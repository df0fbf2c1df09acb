# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface pass: rotations and stretches of triangles are interpolated, and positions are fitted to them."""
