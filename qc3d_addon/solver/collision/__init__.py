# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Collisions: crossing triangles, exact distances from surfaces, colliders, and how frames avoid them."""
