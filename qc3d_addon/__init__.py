# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""QC3D fills in the frames between two shape keys with fold-free volumetric maps.

This module is Blender's way in; it can be imported without Blender, where nothing needs to be registered.
"""

from __future__ import annotations


def register() -> None:
    """Make the operators, properties, panel and command known to Blender."""
    from .blender import registration

    registration.register()


def unregister() -> None:
    """Take back everything that ``register`` made known."""
    from .blender import registration

    registration.unregister()
