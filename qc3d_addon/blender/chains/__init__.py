# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""What can be done with a baked chain: mirror, keyframes, copies, export, removal."""
