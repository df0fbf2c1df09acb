# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Maps and frames in few bytes: the lowest modes of their representation, predicted and entropy-coded."""
