# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Classical in-between methods, written for comparison only; the extension does not use them."""
