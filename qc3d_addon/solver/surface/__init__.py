# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The surface pass: triangles that turn and stretch from one key to the other, solved for positions."""
