# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The experiments of Chen & Lui, "A Novel 3D Mapping Representation and its Applications", made again and measured."""
