# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Combinations of shape keys: additional keys that correct others while they are on at once."""
