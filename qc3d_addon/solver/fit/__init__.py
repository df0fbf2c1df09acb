# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The fold-free map of the cube that carries the first key onto the second: fit, repair and storage."""
