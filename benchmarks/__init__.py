# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Benchmarks: quality, speed and memory of QC3D, alone and against other methods."""
