# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Data that is stored in the .blend file, and reading of meshes as arrays."""
