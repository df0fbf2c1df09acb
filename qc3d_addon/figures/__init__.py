# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Pictures of shapes and maps, drawn with matplotlib and without a window."""
