# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m qc3d_addon`` is the command ``qc3d``."""

import sys
from pathlib import Path

# With -m, Python searches the working folder first, where a file may have the name of a library. Search it last, and
# only if it is the folder that contains this package.
if not sys.flags.safe_path and sys.path:
    folder = sys.path.pop(0)
    if Path(folder).resolve() == Path(__file__).resolve().parents[1]:
        sys.path.append(folder)

from .start import main

sys.exit(main())
