# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Rotations, symmetric matrices, sparse systems: what knows nothing of meshes and keys."""
