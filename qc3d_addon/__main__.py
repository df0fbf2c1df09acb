# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m qc3d_addon`` is the command ``qc3d``."""

import sys

from .start import main

sys.exit(main())
