# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Two keys of one mesh: checked, embedded in the unit cube, read from files."""
