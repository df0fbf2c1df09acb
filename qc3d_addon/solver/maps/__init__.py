# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Piecewise linear maps of tetrahedral meshes: representation, reconstruction, distortion (Chen & Lui, section 5)."""
