# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's experiments and the drawing that they and other commands share; not part of the extension."""
