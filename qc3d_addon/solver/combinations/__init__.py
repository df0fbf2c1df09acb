# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Several keys of one base on at once: the shape that they make together, and whether adding them would do."""
