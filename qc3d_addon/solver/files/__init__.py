# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reading .npz archives without trusting them; writing files whole or not at all."""
