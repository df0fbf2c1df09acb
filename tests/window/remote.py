# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Startup script of the Blender that is tested: runs the code that comes through a socket, between Blender's events.

Each message is Python code that ends with a zero byte. Names stay from one message to the next. The answer is a JSON
array, ``[value of the last expression, null]`` or ``[null, error]``, with a zero byte at its end.
"""

import ast
import contextlib
import json
import socket
import time
import traceback
from collections.abc import Iterator
from pathlib import Path

import bpy

server = socket.socket(socket.AF_UNIX)
bound = Path(__file__).with_name("bound")
server.bind(str(bound))
server.listen()
bound.rename(bound.with_name("socket"))  # which is there once it can be connected to
server.setblocking(False)
connections: list[socket.socket] = []
received = bytearray()


def view() -> tuple[bpy.types.Window, bpy.types.Area]:
    """The window, and its largest 3D view."""
    window = bpy.context.window_manager.windows[0]
    views = [area for area in window.screen.areas if area.type == 'VIEW_3D']
    return window, max(views, key=lambda area: area.width * area.height)


def region(kind: str) -> bpy.types.Region:
    return next(region for region in view()[1].regions if region.type == kind)


@contextlib.contextmanager
def inside(kind: str) -> Iterator[None]:
    """The context that an operator has with the mouse over a region of the 3D view."""
    window, area = view()
    with bpy.context.temp_override(window=window, area=area, region=region(kind)):
        yield


def hovered() -> str:
    """What the button under the mouse does: the call of its operator, or the path of its property."""
    window_manager = bpy.context.window_manager
    window_manager.clipboard = ""
    with inside('UI'):
        for copy in (bpy.ops.ui.copy_python_command_button, bpy.ops.ui.copy_data_path_button):
            if copy.poll():
                copy()
                break
    return window_manager.clipboard


def reports() -> str:
    """The sentences that Blender has shown, one a line; an Info editor in place of the timeline copies them."""
    window = view()[0]
    area = min(window.screen.areas, key=lambda area: area.height)
    kind = area.ui_type
    area.ui_type = 'INFO'
    space = area.spaces.active
    space.show_report_operator = False
    space.show_report_info = space.show_report_warning = space.show_report_error = True
    main = next(region for region in area.regions if region.type == 'WINDOW')
    with bpy.context.temp_override(window=window, area=area, region=main):
        bpy.ops.info.select_all(action='SELECT')
        bpy.ops.info.report_copy()
    area.ui_type = kind
    return bpy.context.window_manager.clipboard


class Redraws:
    """Asks for one redraw of the 3D view after the other, and notes when each is made."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self._draw = bpy.types.SpaceView3D.draw_handler_add(self._note, (), 'WINDOW', 'POST_PIXEL')
        bpy.app.timers.register(self._ask, persistent=True)

    def stop(self) -> list[float]:
        """The times in seconds."""
        bpy.types.SpaceView3D.draw_handler_remove(self._draw, 'WINDOW')
        self._draw = None
        return self.times

    def _note(self) -> None:
        self.times.append(time.monotonic())

    def _ask(self) -> float | None:
        region('WINDOW').tag_redraw()
        return None if self._draw is None else 0.005  # None ends the timer


def serve() -> float:
    with contextlib.suppress(BlockingIOError):
        while True:
            connections.append(server.accept()[0])
    for connection in list(connections):
        with contextlib.suppress(BlockingIOError):
            connection.setblocking(False)
            chunk = connection.recv(65536)
            if not chunk:
                connections.remove(connection)
            received.extend(chunk)
            while b"\0" in received:
                message, _, rest = bytes(received).partition(b"\0")
                received[:] = rest
                answer = run(message.decode()).encode() + b"\0"
                connection.setblocking(True)
                connection.sendall(answer)
    return 0.01


def run(code: str) -> str:
    try:
        tree = ast.parse(code)
        last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
        exec(compile(tree, "<message>", "exec"), globals())
        value = None if last is None else eval(compile(ast.Expression(last.value), "<message>", "eval"), globals())
        return json.dumps([value, None], default=list)
    except Exception:
        return json.dumps([None, traceback.format_exc()])



bpy.app.timers.register(serve, first_interval=1.0, persistent=True)
