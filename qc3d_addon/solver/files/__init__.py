# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads .npz archives from untrusted sources; writes files completely or not at all."""
