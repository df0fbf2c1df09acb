# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Shape keys that are on at once, and the keys that make them move rightly together."""
