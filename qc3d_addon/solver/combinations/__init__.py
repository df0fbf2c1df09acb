# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Combinations: the shape of several keys on at once, and which pairs of keys need more than addition."""
