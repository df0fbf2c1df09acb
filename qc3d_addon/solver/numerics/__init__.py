# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Linear algebra that knows nothing of meshes or keys: rotations, symmetric matrices, sparse systems."""
