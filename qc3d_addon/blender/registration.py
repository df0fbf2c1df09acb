# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Registration: all classes in the order in which Blender needs them, handlers and the command."""

from __future__ import annotations

from collections.abc import Callable

import bpy

from ..worker import engines
from . import choices, cli, compat, live_scrub, preferences, properties, translations
from .bake import jobs
from .heat_map import legend
from .keys import straight
from .operators.bake_inbetweens import (
    QC3D_OT_add_here,
    QC3D_OT_bake_inbetweens,
    QC3D_OT_bake_objects,
    QC3D_OT_rebake,
)
from .operators.bake_keys import KeyChoice, QC3D_OT_bake_keys
from .operators.bug_report import QC3D_OT_copy_report, QC3D_OT_save_report
from .operators.cancel import QC3D_OT_cancel
from .operators.chains import (
    QC3D_OT_absolute_keys,
    QC3D_OT_export_alembic,
    QC3D_OT_mirror,
    QC3D_OT_play_on_key,
    QC3D_OT_remove,
    QC3D_OT_to_keyframes,
)
from .operators.combinations import QC3D_OT_combine_keys, QC3D_OT_judge_pairs, QC3D_OT_remove_combination
from .operators.exports import QC3D_OT_export_in_betweens, QC3D_OT_read_usd
from .operators.forget_record import QC3D_OT_forget_record
from .operators.heat_map import QC3D_OT_heat_map, QC3D_OT_select_worst
from .operators.inner_keys import (
    QC3D_OT_add_inner_key,
    QC3D_OT_go_through_sculpted,
    QC3D_OT_keys_from_timeline,
    QC3D_OT_remove_inner_key,
)
from .operators.live_scrub import QC3D_OT_live_scrub
from .operators.map_files import QC3D_OT_load_map, QC3D_OT_save_map
from .operators.open_demo import QC3D_OT_open_demo
from .operators.prepare import QC3D_OT_prepare
from .operators.split_key import QC3D_OT_split_key
from .operators.straight import QC3D_OT_straight
from .ui import bake_list, menus, panel_combinations, panel_exports, panel_results, panels, presets

CLASSES = (
    choices.InnerKey,  # before the settings that contain it
    properties.TimedKey,
    properties.ObjectSettings,
    QC3D_OT_prepare,
    preferences.QC3DPreferences,
    QC3D_OT_bake_inbetweens,
    KeyChoice,
    QC3D_OT_bake_keys,
    QC3D_OT_bake_objects,
    QC3D_OT_split_key,
    QC3D_OT_rebake,
    QC3D_OT_add_here,
    QC3D_OT_cancel,
    QC3D_OT_heat_map,
    QC3D_OT_select_worst,
    QC3D_OT_live_scrub,
    QC3D_OT_straight,
    QC3D_OT_remove,
    QC3D_OT_play_on_key,
    QC3D_OT_to_keyframes,
    QC3D_OT_absolute_keys,
    QC3D_OT_mirror,
    QC3D_OT_export_alembic,
    QC3D_OT_export_in_betweens,
    QC3D_OT_combine_keys,
    QC3D_OT_judge_pairs,
    QC3D_OT_remove_combination,
    QC3D_OT_read_usd,
    QC3D_OT_save_map,
    QC3D_OT_load_map,
    QC3D_OT_forget_record,
    QC3D_OT_open_demo,
    QC3D_OT_copy_report,
    QC3D_OT_save_report,
    QC3D_OT_add_inner_key,
    QC3D_OT_go_through_sculpted,
    QC3D_OT_keys_from_timeline,
    QC3D_OT_remove_inner_key,
    presets.QC3D_PT_presets,
    presets.QC3D_OT_add_preset,
    panels.QC3D_PT_inbetweens,
    bake_list.QC3D_UL_bakes,
    panel_results.QC3D_PT_results,  # after its parent
    panel_combinations.QC3D_PT_combinations,
    panel_exports.QC3D_PT_exports,
)

_commands: list[object] = []


def register() -> None:
    """Register the classes, the object's settings and the command ``blender --command qc3d``."""
    translations.register()
    for cls in CLASSES:
        bpy.utils.register_class(cls)
    pointer: Callable[..., object] = bpy.props.PointerProperty  # some stubs say that it returns nothing
    setattr(bpy.types.Object, properties.SETTINGS, pointer(type=properties.ObjectSettings))
    jobs.register()
    menus.register()
    legend.register()
    live_scrub.register()
    straight.register()
    _commands.extend(compat.register_command("qc3d", cli.run_command))


def unregister() -> None:
    """Undo ``register`` in reverse order."""
    while _commands:
        compat.unregister_command(_commands.pop())
    straight.unregister()
    live_scrub.unregister()
    legend.unregister()
    menus.unregister()
    jobs.unregister()
    engines.forget()
    delattr(bpy.types.Object, properties.SETTINGS)
    for cls in reversed(CLASSES):
        bpy.utils.unregister_class(cls)
    translations.unregister()
