# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Random input of every kind: each case ends with a result or with a typed error, in bounded time and memory."""
