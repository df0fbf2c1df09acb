# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The bundled solver: arrays in, in-between frames out. Needs numpy and scipy; never imports bpy."""
