# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""A real Blender in a window on a virtual screen, operated with mouse and keyboard and queried in Python.

It runs in a folder with a complete system to chroot into: Blender, scipy, Xvfb, xdotool, ImageMagick and software
OpenGL, with /proc and /dev mounted. That needs root.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

REPOSITORY = Path(__file__).resolve().parents[2]
NEEDED = ("usr/bin/blender", "usr/bin/Xvfb", "usr/bin/xdotool", "usr/bin/import", "proc/self", "dev/shm")
T = TypeVar("T")
PATIENCE = 120.0  # seconds after which something that should happen is taken not to happen


def missing(root: str | None) -> str | None:
    """Why there is no Blender to test in that folder, or None."""
    if not root:
        return "QC3D_BLENDER_ROOT is not set: no Blender with a window to test in"
    lacking = [name for name in NEEDED if not os.path.lexists(Path(root) / name)]
    return f"{root} has no {', '.join(lacking)}" if lacking else None


class Window:
    """Blender with its window, with a user folder of its own; everything ends with ``close``.

    Parameters
    ----------
    root
        The folder to chroot into.
    size
        Width and height of the screen, which the window fills, in pixels.
    package
        Whether to install the add-on from this repository, and enable it.
    home
        The user's home as a path inside the root; by default a folder of its own.
    """

    def __init__(
        self, root: Path, size: tuple[int, int] = (1280, 800), package: bool = True, home: str | None = None
    ) -> None:
        self.root, self.size = root, size
        self.folder = root / "tmp" / f"qc3d-window-{os.getpid()}-{time.monotonic_ns()}"
        self.inside = Path("/tmp") / self.folder.name
        self._screen: subprocess.Popen[str] | None = None
        self._socket: socket.socket | None = None
        (self.folder / "user").mkdir(parents=True)
        shutil.copy(Path(__file__).with_name("remote.py"), self.folder)
        if package:
            extension = self.folder / "user/extensions/user_default/qc3d"
            shutil.copytree(REPOSITORY / "qc3d_addon", extension, ignore=shutil.ignore_patterns("__pycache__"))
            shutil.copy(REPOSITORY / "blender_manifest.toml", extension)
        self._environment = {
            "HOME": home or str(self.inside),
            "PATH": "/usr/sbin:/usr/bin:/sbin:/bin",
            "LC_ALL": "C.UTF-8",
            "TMPDIR": str(self.inside),
            "LIBGL_ALWAYS_SOFTWARE": "1",
            "XDG_RUNTIME_DIR": str(self.inside),
            "BLENDER_USER_RESOURCES": str(self.inside / "user"),
            "OMP_NUM_THREADS": os.environ.get("OMP_NUM_THREADS", "2"),
        }
        try:
            self._start_screen()
            self.start()
            if package:
                self.ask("bpy.ops.preferences.addon_enable(module='bl_ext.user_default.qc3d')")
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Window:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def start(self) -> None:
        """Start Blender; the user folder stays from one start to the next."""
        (self.folder / "socket").unlink(missing_ok=True)
        width, height = self.size
        arguments = ["--window-geometry", "0", "0", str(width), str(height), "--gpu-backend", "opengl"]
        script = ["--python", str(self.inside / "remote.py")]
        with (self.folder / "log.txt").open("a") as log:
            self.blender = subprocess.Popen(
                ["chroot", str(self.root), "blender", *arguments, *script],
                env=self._environment,
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self.wait((self.folder / "socket").exists, "Blender starts")
        self._socket = socket.socket(socket.AF_UNIX)
        self._socket.settimeout(PATIENCE)
        self._socket.connect(str(self.folder / "socket"))
        self.ask("bpy.context.preferences.view.show_splash = False")
        self.move(self.size[0] // 3, self.size[1] // 2)

    def close(self) -> None:
        """End Blender and the screen, and remove their files."""
        if self._socket is not None:
            self._socket.close()
        for process in (getattr(self, "blender", None), self._screen):
            if process is not None:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        shutil.rmtree(self.folder)

    @property
    def log(self) -> str:
        """What Blender wrote to its terminal."""
        return (self.folder / "log.txt").read_text(errors="replace")

    def ask(self, code: str, patience: float = PATIENCE) -> Any:  # noqa: ANN401 - whatever JSON holds
        """Run Python code in Blender, for so many seconds at most; the value of its last line, as JSON can hold it."""
        assert self._socket is not None
        self._socket.settimeout(patience)
        self._socket.sendall(code.encode() + b"\0")
        answer = b""
        while not answer.endswith(b"\0"):
            chunk = self._socket.recv(65536)
            if not chunk:
                raise ConnectionError(f"Blender is gone:\n{self.log[-3000:]}")
            answer += chunk
        value, error = json.loads(answer[:-1])
        if error is not None:
            raise RuntimeError(f"{code}\n{error}")
        return value

    def wait(self, done: Callable[[], T], what: str) -> T:
        """Wait until ``done`` gives something true, and return it."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if value := done():
                return value
            if self.blender.poll() is not None:
                break
            time.sleep(0.05)
        raise AssertionError(f"did not come: {what}; Blender's status {self.blender.poll()}:\n{self.log[-3000:]}")

    def wait_gone(self, process: int) -> None:
        """Wait until there is no process of that number, whether Blender is there or not."""
        end = time.monotonic() + PATIENCE
        while is_alive(process):
            assert time.monotonic() < end, f"process {process} goes on"
            time.sleep(0.01)

    def wait_for(self, expression: str) -> Any:  # noqa: ANN401 - as ask
        """Wait until a Python expression in Blender is true; its value."""
        return self.wait(lambda: self.ask(expression), expression)

    def move(self, x: int, y: int) -> None:
        """Put the mouse there; pixels from the top left."""
        self._xdotool("mousemove", str(x), str(y))

    def click(self, x: int, y: int) -> None:
        """Click there; Blender has to see the mouse before its button is pressed."""
        self.move(x, y)
        time.sleep(0.3)
        self.press_mouse()

    def press_mouse(self, button: int = 1, times: int = 1) -> None:
        """Press a button of the mouse where it is: 1 to 3, or 4 and 5 to turn its wheel up and down."""
        self._xdotool("click", "--repeat", str(times), "--delay", "20", str(button))

    def drag(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Drag with the left button from one place to another, in steps as a hand does."""
        self.move(*start)
        time.sleep(0.3)
        self._xdotool("mousedown", "1")
        for step in range(1, 11):
            self.move(*(round(a + (b - a) * step / 10) for a, b in zip(start, end, strict=True)))
            time.sleep(0.03)
        time.sleep(0.5)  # a busy Blender takes a quick drag for a click
        self._xdotool("mouseup", "1")
        time.sleep(0.3)

    def press(self, *keys: str) -> None:
        """Press keys one after the other, named as xdotool does, as "ctrl+z" or "Escape"."""
        self._xdotool("key", *keys)

    def type(self, text: str) -> None:
        """Type a text."""
        self._xdotool("type", "--delay", "30", text)

    def place_window(self, name: str, left: int, top: int, width: int, height: int) -> None:
        """Move and size a window of Blender, which no window manager does here."""
        place = ["windowmove", str(left), str(top), "windowsize", str(width), str(height)]
        self._xdotool("search", "--sync", "--name", name, *place)
        time.sleep(1.0)

    def open_sidebar(self) -> None:
        """Open the 3D view's sidebar on the tab of the add-on."""
        self.ask("view()[1].spaces.active.show_region_ui = True")
        self.wait_for("region('UI').width > 1 and region('UI').active_panel_category != 'UNSUPPORTED'")
        self.ask("region('UI').active_panel_category = 'QC3D'")
        self.wait_for("region('UI').tag_redraw() or region('UI').active_panel_category == 'QC3D'")
        time.sleep(0.5)

    def hover_sidebar(self) -> None:
        """Put the mouse into the sidebar, where it shows nothing."""
        left, bottom, width, _ = self.ask("r = region('UI'); [r.x, r.y, r.width, r.height]")
        self.move(left + width // 2, self.size[1] - bottom - 6)
        time.sleep(0.3)

    def find(self, button: str) -> tuple[int, int]:
        """Where in the sidebar the button is whose operator or property contains the text.

        The mouse hovers from top to bottom; where the button is not there, the sidebar is scrolled from its top.
        """
        left, bottom, width, height = self.ask("r = region('UI'); [r.x, r.y, r.width, r.height]")
        top = self.size[1] - bottom - height
        seen = []
        for scroll in range(6):
            if scroll > 0:  # to the top first, then down
                self.press_mouse(4 if scroll == 1 else 5, 60 if scroll == 1 else height // 60)
                time.sleep(0.3)
            for part in (0.5, 0.25, 0.75):  # of the width: a row may have several buttons
                x = left + int(part * (width - 16))
                for y in range(top + 8, top + height, 12):
                    self.move(x, y)
                    time.sleep(0.06)
                    seen.append(self.ask("hovered()"))
                    if button in seen[-1]:
                        time.sleep(0.2)  # Blender may not have seen that the mouse has left another button
                        if button in self.ask("hovered()"):
                            return x, y
        raise AssertionError(f"there is no button {button} in the sidebar: {sorted({*seen})}")

    def push(self, button: str) -> None:
        """Find a button in the sidebar and click it."""
        self.click(*self.find(button))

    def shoot(self, path: Path, crop: tuple[int, int, int, int] | None = None) -> None:
        """Save a picture of the screen, or of a part of it: left, top, width, height."""
        part = [] if crop is None else ["-crop", "{2}x{3}+{0}+{1}".format(*crop), "+repage"]
        inside = self.inside / "shot.png"
        self._run("import", "-window", "root", *part, str(inside))
        path.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(self.folder / "shot.png", path)

    def _start_screen(self) -> None:
        size = "x".join(map(str, (*self.size, 24)))
        command = ["chroot", str(self.root), "Xvfb", "-displayfd", "1", "-screen", "0", size, "-noreset"]
        self._screen = subprocess.Popen(
            [*command, "-nolisten", "tcp", "+extension", "GLX"],
            env=self._environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
        )
        assert self._screen.stdout is not None
        self._environment["DISPLAY"] = f":{self._screen.stdout.readline().strip()}"

    def _xdotool(self, *arguments: str) -> None:
        self._run("xdotool", *arguments)

    def _run(self, *command: str) -> None:
        subprocess.run(["chroot", str(self.root), *command], env=self._environment, check=True)


@contextlib.contextmanager
def redraws(window: Window) -> Iterator[list[float]]:
    """Redraw the 3D view as often as Blender can; afterward the list holds the seconds between the redraws."""
    gaps: list[float] = []
    window.ask("counter = Redraws()")
    try:
        yield gaps
    finally:
        times = window.ask("counter.stop()")
        gaps += [later - earlier for earlier, later in pairwise(times)]


@contextlib.contextmanager
def paused(process: int) -> Iterator[None]:
    """Hold a process meanwhile, so that it matters to nobody how fast its work is."""
    os.kill(process, signal.SIGSTOP)
    try:
        yield
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGCONT)


def is_alive(process: int) -> bool:
    """Whether there is a process of that number."""
    return Path(f"/proc/{process}").exists()
