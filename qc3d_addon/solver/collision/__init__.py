# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Crossing triangles, distances from surfaces, and how in-betweens keep clear of both."""
