# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress, threads, memory, and child processes that leave nothing behind."""
