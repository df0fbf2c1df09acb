# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's experiments, and all drawing with matplotlib; not part of the extension."""
