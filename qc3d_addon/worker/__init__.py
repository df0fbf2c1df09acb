# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Carries out tasks in child processes, so that the user interface stays responsive and survives every failure."""
