# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender, or with its Python module, to try a package as a user would; prints a line "RESULT" and JSON.

    use_installed.py install PACKAGE.zip    install it from disk and enable it, as the preferences' menu does
    use_installed.py use                    later: disable and enable it, bake with both engines, uninstall it

Inside Blender: ``blender --background --python use_installed.py -- use``. It needs nothing of the tests.
"""

from __future__ import annotations

import importlib
import json
import sys
import threading
import time
from pathlib import Path

import bpy

# isort: split
# Blender's own modules can be imported once bpy is.
import addon_utils

MODULE = "bl_ext.user_default.qc3d"


def main() -> None:
    arguments = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else sys.argv[1:]
    result = install(arguments[1]) if arguments[0] == "install" else use()
    print("RESULT", json.dumps(result), flush=True)


def install(package: str) -> dict[str, object]:
    """Install a package from disk into the user's own repository."""
    bpy.ops.extensions.package_install_files(filepath=package, repo='user_default', enable_on_install=True)
    bpy.ops.wm.save_userpref()
    return {"enabled": addon_utils.check(MODULE)[1], "slow imports": _slow_imports()}


def use() -> dict[str, object]:
    """Enable, disable, enable, bake, uninstall."""
    if addon_utils.check(MODULE)[1]:
        bpy.ops.preferences.addon_disable(module=MODULE)
    without = _known()
    bpy.ops.preferences.addon_enable(module=MODULE)
    bpy.ops.preferences.addon_disable(module=MODULE)
    left = _differences(without, _known())
    bpy.ops.preferences.addon_enable(module=MODULE)
    enabled = _known()
    result = {
        "left behind": left,
        "added": _differences(without, enabled),
        "slow imports": _slow_imports(),
        "baked": {engine: _bake(engine) for engine in ("tetwild", "delaunay")},
        "notice": _notice(),
        "libraries": _libraries(),
        "pytetwild imported": "pytetwild" in sys.modules,
    }
    repositories = [repository.module for repository in bpy.context.preferences.extensions.repos]
    bpy.ops.extensions.package_uninstall(repo_index=repositories.index("user_default"), pkg_id="qc3d")
    result["left behind after uninstalling"] = _differences(without, _known())
    result["modules after uninstalling"] = [name for name in sys.modules if name.startswith(MODULE)]
    folder = Path(bpy.utils.user_resource('EXTENSIONS'))
    result["files after uninstalling"] = [
        str(path.relative_to(folder))
        for path in (folder / "user_default/qc3d", *folder.glob(".local/lib/python*/site-packages/*"))
        if path.exists()
    ]
    return result


def _bake(engine: str) -> dict[str, object]:
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=2)
    obj = bpy.context.active_object
    obj.shape_key_add(name="Basis", from_mix=False)
    key = obj.shape_key_add(name="Lean", from_mix=False)
    key.value = 0.0
    for point in key.points:
        point.co.x += 0.4 * max(point.co.z, 0.0) ** 2
    start = time.perf_counter()
    status = bpy.ops.qc3d.bake_inbetweens(
        play_on="slider",
        from_key="Basis", to_key="Lean", count=2, quality='normal', engine=engine, use_keyframes=False
    )
    seconds = time.perf_counter() - start
    made = [key.name for key in obj.data.shape_keys.key_blocks if "_to_" in key.name]
    return {"status": sorted(status), "keys": made, "seconds": round(seconds, 1)}


def _notice() -> str | None:
    """The panel's sentence about the engine, once it is known."""
    engines = importlib.import_module(f"{MODULE}.worker.engines")
    engines.engine_notice()
    time.sleep(2.0)
    notice: str | None = engines.engine_notice()
    return notice


def _libraries() -> dict[str, str]:
    import numpy
    import scipy

    return {module.__name__: f"{module.__version__} {module.__file__}" for module in (numpy, scipy)}


def _slow_imports() -> list[str]:
    return [name for name in ("scipy", "pytetwild", "pyvista") if name in sys.modules]


def _known() -> dict[str, list[str]]:
    """What an add-on can add to Blender."""
    keyconfigs = bpy.context.window_manager.keyconfigs
    owners = [getattr(bpy.types, name) for name in ("Object", "Scene", "WindowManager", "Window", "Key", "Mesh")]
    handlers = [name for name in dir(bpy.app.handlers) if isinstance(getattr(bpy.app.handlers, name), list)]
    return {
        "types": [name for name in dir(bpy.types) if not name.startswith("_")],
        "operators": [name for name in dir(bpy.ops.qc3d) if not name.startswith("_")],
        "properties": [f"{owner.__name__}.{name}" for owner in owners for name, _ in owner.bl_rna.properties.items()],
        "panels and menus": [
            f"{name}: {getattr(draw, '__module__', draw)}"
            for name in dir(bpy.types)
            for draw in getattr(getattr(getattr(bpy.types, name), "draw", None), "_draw_funcs", ())
            # Blender lists its own function too, from the first time that anything is added to it.
            if not draw.__module__.startswith("bl_ui.")
        ],
        "handlers": [f"{name}: {call.__module__}" for name in handlers for call in getattr(bpy.app.handlers, name)],
        "keymaps": [
            f"{name}: {keymap.name}: {item.idname}"
            for name, config in keyconfigs.items()
            for keymap in config.keymaps
            for item in keymap.keymap_items
        ],
        "threads": [thread.name for thread in threading.enumerate()],
    }


def _differences(before: dict[str, list[str]], after: dict[str, list[str]]) -> dict[str, list[str]]:
    found = {kind: sorted(set(before[kind]) ^ set(after[kind])) for kind in before}
    return {kind: names for kind, names in found.items() if names}


if __name__ == "__main__":
    main()
