# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m qc3d_addon`` is the command ``qc3d``."""

import sys
from pathlib import Path

# Python looks into the working folder first here, where a file may have the name of a library. Last is early enough,
# and only where the working folder is the one that this package lies in.
if not sys.flags.safe_path and sys.path:
    folder = sys.path.pop(0)
    if Path(folder).resolve() == Path(__file__).resolve().parents[1]:
        sys.path.append(folder)

from .start import main

sys.exit(main())
