# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""Outputs of all commands: only ordinary files are replaced, links are followed, unfinished files stay private."""

from __future__ import annotations

import json
import os
import shutil
import socket
import stat
from collections.abc import Callable
from pathlib import Path

import bpy
import numpy as np
import pytest

import contact_sheet
from qc3d_addon.cli import interpolate
from qc3d_addon.solver.errors import InputError
from qc3d_addon.solver.files.atomic import replacing, require_writable

from .commands import (
    COMMANDS,
    FOLDER_COMMANDS,
    KEYS,
    QUICK,
    SCENE_KEYS,
    command,
    folder_command,
    is_sentence,
    listing,
)
from .conftest import NOBODY, Run

pytestmark = pytest.mark.skipif(os.name == "nt", reason="makes pipes and links as Linux and macOS do")


def _pipe(path: Path) -> None:
    os.mkfifo(path)


def _socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as made:
        made.bind(os.path.relpath(path))  # the name of a socket is short


def _device(path: Path) -> None:
    try:
        os.mknod(path, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
    except PermissionError:
        pytest.skip("only root may make devices")


def _link_to_a_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


NO_FILES = [_pipe, _socket, _device, _link_to_a_pipe]


class TestWhatIsNoFile:
    @pytest.mark.parametrize("make", NO_FILES)
    @pytest.mark.parametrize("name", COMMANDS)
    def test_is_refused_by_every_command(self, name: str, make: Callable[[Path], None], here: Path, run: Run) -> None:
        output = here / f"odd{COMMANDS[name][1]}"
        make(output)
        before = listing(here)
        status, said = run(*command(name, output))
        assert status == 2
        assert is_sentence(said)
        assert "is a device, a pipe or a socket, which is never written to; give the name of a file" in said
        assert listing(here) == before

    @pytest.mark.parametrize("make", NO_FILES)
    @pytest.mark.parametrize("name", FOLDER_COMMANDS)
    def test_is_refused_in_a_folder(self, name: str, make: Callable[[Path], None], here: Path, run: Run) -> None:
        (here / "found").mkdir()
        make(here / "found" / FOLDER_COMMANDS[name][1])
        before = listing(here)
        status, said = run(*folder_command(name, "found"))
        assert status == 2
        assert is_sentence(said)
        assert "is a device, a pipe or a socket" in said
        assert listing(here) == before

    @pytest.mark.parametrize("make", NO_FILES)
    def test_is_refused_by_the_contact_sheet(self, make: Callable[[Path], None], here: Path) -> None:
        make(here / "odd.png")
        before = listing(here)
        with pytest.raises(SystemExit, match="is a device, a pipe or a socket"):
            contact_sheet.main(["frames.npz", "--output", "odd.png"])
        assert listing(here) == before

    @pytest.mark.parametrize("make", NO_FILES)
    def test_is_refused_where_it_comes_during_the_work(self, make: Callable[[Path], None], here: Path) -> None:
        with pytest.raises(InputError, match="is a device"), replacing(here / "new.npz") as new:  # noqa: PT012
            new.write_text("whole")
            make(here / "new.npz")
            before = listing(here)
        assert {name: it for name, it in before.items() if not name.startswith(".")} == listing(here)


class TestLinks:
    @pytest.mark.parametrize("is_there", [True, False])
    @pytest.mark.parametrize("name", COMMANDS)
    def test_are_followed_by_every_command(self, name: str, is_there: bool, here: Path, run: Run) -> None:
        ending = COMMANDS[name][1]
        (here / "elsewhere").mkdir()
        real, link = here / "elsewhere" / f"real{ending}", here / f"link{ending}"
        if is_there:
            real.write_text("earlier")
        link.symlink_to(real)
        assert run(*command(name, link, here / "other.npz"))[0] == 0
        assert link.is_symlink()
        assert real.stat().st_size > 7
        assert [path.name for path in (here / "elsewhere").iterdir()] == [real.name]

    def test_to_nowhere_and_round_in_circles(self, here: Path, run: Run) -> None:
        (here / "circle.npz").symlink_to("circle.npz")
        (here / "nowhere.npz").symlink_to("missing/real.npz")
        before = listing(here)
        for name, reason in (("circle.npz", "Too many levels of symbolic links"), ("nowhere.npz", "No such file")):
            status, said = run(*command("interpolate", name))
            assert status == 2
            assert is_sentence(said)
            assert f"{name} cannot be written: {reason}" in said
        assert listing(here) == before


class TestWhatIsHalfDone:
    def test_is_where_nobody_else_can_reach_it(self, here: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
        """A name that can be told before, or that is free for a moment, is a place to put a link to another file."""
        seen = []
        write = interpolate.write_frames

        def spy(path: Path, *rest: object) -> None:
            assert not path.exists()
            seen.append(path)
            write(path, *rest)

        monkeypatch.setattr(interpolate, "write_frames", spy)
        for _ in range(2):
            assert run(*command("interpolate", "new.npz"))[0] == 0
        assert seen[0] != seen[1]
        for path in seen:
            assert path.parent != here
            assert not path.parent.exists()
            assert str(os.getpid()) not in path.name

    def test_is_in_a_folder_for_this_user_alone(self, tmp_path: Path) -> None:
        with replacing(tmp_path / "new.npz") as new:
            assert stat.S_IMODE(new.parent.stat().st_mode) == 0o700
            new.write_text("whole")

    def test_of_a_blend_file_has_a_name_that_nobody_can_guess(
        self, here: Path, run: Run, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        from qc3d_addon.blender.bake import run as bake

        before = set(os.listdir())
        seen = []
        save = bake._save

        def spy(new: Path, *rest: object) -> None:
            seen.append(new.name)
            known = set(os.listdir()) - before
            assert not any(new.stem.startswith(name) for name in known)
            save(new, *rest)

        monkeypatch.setattr(bake, "_save", spy)
        for _ in range(2):
            assert run(*command("bake", "new.blend"))[0] == 0
        assert len(seen[0]) >= 32 + len(".blend")
        assert seen[0] != seen[1]
        assert set(os.listdir()) - before == {"new.blend"}

    @pytest.mark.parametrize("name", ["interpolate", "bake", "compress"])
    def test_of_an_earlier_process_is_in_nobodys_way(self, name: str, here: Path, run: Run) -> None:
        """Names as made of a process number, which comes again."""
        ending = COMMANDS[name][1]
        for kind in ("part", "old"):
            (here / f".new.{os.getpid()}.{kind}{ending}").write_text("half")
        assert run(*command(name, f"new{ending}"))[0] == 0

    def test_in_several_files_is_refused(self, here: Path, run: Run) -> None:
        """The second file would lie under the name of the unfinished one."""
        before = listing(here)
        status, said = run("reconstruct", "map.npz", "--output", "new.node")
        assert status == 2
        assert is_sentence(said)
        assert "new.node cannot be written: " in said
        assert listing(here) == before


class TestInputs:
    @pytest.mark.parametrize("alias", ["the same", "another spelling", "a link", "a hard link"])
    @pytest.mark.parametrize(
        ("source", "arguments"),
        [
            ("map.npz", ["compress", "map.npz", "--modes", "3", "--scheme", "published", "--output", "OUT"]),
            ("frames.npz", ["compress", "frames.npz", "--modes", "3", "--output", "OUT"]),
            ("map.npz", ["compress", "bar.npz", "--target", "map.npz", "--modes", "3", "--output", "OUT"]),
            ("map.npz", ["compress", "map.npz", "--modes", "3", "--output", "new.qc3d", "--report", "OUT"]),
            ("map.npz", ["decompress", "map.qc3d", "map.npz", "--output", "OUT"]),
            ("map.qc3d", ["decompress", "map.qc3d", "map.npz", "--output", "OUT"]),
            ("map.npz", ["reconstruct", "map.npz", "--output", "OUT"]),
            ("marks.csv", ["reconstruct", "map.npz", "--landmarks", "marks.csv", "--output", "OUT"]),
            ("bar.npz", ["interpolate", "bar.npz", *KEYS, "--frames", "0", *QUICK, "--output", "OUT"]),
            ("bar.npz", ["interpolate", "bar.npz", *KEYS, "--frames", "0", "--output", "new.npz", "--report", "OUT"]),
            ("bar.blend", ["bake", "bar.blend", *SCENE_KEYS, "--frames", "1", "--output", "b", "--report", "OUT"]),
        ],
    )
    def test_are_never_written_over(self, source: str, arguments: list[str], alias: str, here: Path, run: Run) -> None:
        (here / "marks.csv").write_text("vertex,x,y,z\n0,0,0,0\n")
        output = f"alias{Path(source).suffix}"
        if alias == "the same":
            output = source
        elif alias == "another spelling":
            output = f"../here/./{source}"
        elif alias == "a link":
            (here / output).symlink_to(source)
        else:
            os.link(source, output)
        before = listing(here)
        status, said = run(*[output if part == "OUT" else part for part in arguments])
        assert status == 2
        assert is_sentence(said)
        assert "is named twice" in said
        assert listing(here) == before

    @pytest.mark.parametrize("option", ["FILE", "--target"])
    def test_are_not_written_over_in_a_folder(self, option: str, here: Path, run: Run) -> None:
        (here / "found").mkdir()
        shutil.copy("map.npz", "found/mapping.npz")
        before = listing(here)
        files = ["found/mapping.npz"] if option == "FILE" else ["map.npz", "--target", "found/mapping.npz"]
        status, said = run("analyze", *files, "--output", "found")
        assert status == 2
        assert "is named twice" in said
        assert listing(here) == before

    def test_of_the_contact_sheet(self, here: Path) -> None:
        (here / "frames.png").symlink_to("frames.npz")
        with pytest.raises(SystemExit, match="is named twice"):
            contact_sheet.main(["frames.npz", "--output", "frames.png"])
        assert contact_sheet.main(["frames.npz", "--height", "40", "--output", "sheet.png"]) is None
        assert (here / "sheet.png").read_bytes()[1:4] == b"PNG"

    def test_the_same_output_twice(self, here: Path, run: Run) -> None:
        (here / "new.npz").write_text("earlier")
        os.link("new.npz", "again.json")
        for report in ("new.npz", "./new.npz", "again.json"):
            assert "is named twice" in run(*command("interpolate's report", report, "new.npz"))[1]

    def test_a_blend_file_may_be_baked_in_place(self, here: Path, run: Run) -> None:
        before = (here / "bar.blend").read_bytes()
        assert run(*command("bake", "bar.blend"))[0] == 0
        assert (here / "bar.blend").read_bytes() != before


class TestWhatIsReplaced:
    @pytest.mark.parametrize("mode", [0o600, 0o640, 0o664, 0o755])
    @pytest.mark.parametrize("name", ["interpolate", "interpolate's report", "bake"])
    def test_keeps_its_mode(self, name: str, mode: int, here: Path, run: Run) -> None:
        output = here / f"new{COMMANDS[name][1]}"
        output.write_text("earlier")
        output.chmod(mode)
        assert run(*command(name, output, here / "other.npz"))[0] == 0
        assert stat.S_IMODE(output.stat().st_mode) == mode

    def test_keeps_its_owner(self, here: Path, run: Run) -> None:
        output = here / "new.npz"
        output.write_text("earlier")
        try:
            os.chown(output, NOBODY, NOBODY - 1)
        except PermissionError:
            pytest.skip("only root may give files away")
        assert run(*command("interpolate", output))[0] == 0
        assert (output.stat().st_uid, output.stat().st_gid) == (NOBODY, NOBODY - 1)

    def test_of_another_group_is_not_opened_to_mine(self, unprivileged: Path) -> None:
        """Its group could read it, others could not: whoever may not give it to that group gives it to nobody."""
        output = unprivileged / "new.json"
        output.write_text("earlier")
        output.chmod(0o660)
        if os.getuid() != 0:
            pytest.skip("only root can make a file of a group that it then leaves")
        os.seteuid(0)
        os.chown(output, NOBODY, 4242)
        groups, group = os.getgroups(), os.getegid()
        os.setgroups([])
        os.setegid(NOBODY)
        os.seteuid(NOBODY)
        try:
            with replacing(output) as new:
                new.write_text("{}")
            found = output.stat()
        finally:
            os.seteuid(0)
            os.setegid(group)
            os.setgroups(groups)
            os.seteuid(NOBODY)
        assert found.st_gid != 4242
        assert stat.S_IMODE(found.st_mode) == 0o600

    def test_keeps_its_access_lists(self, tmp_path: Path) -> None:
        output = tmp_path / "new.json"
        output.write_text("earlier")
        try:
            os.setxattr(output, "user.qc3d", b"kept")
        except (OSError, AttributeError):
            pytest.skip("no attributes on this file system")
        with replacing(output) as new:
            new.write_text("{}")
        assert os.getxattr(output, "user.qc3d") == b"kept"

    def test_is_not_where_it_is_protected(self, unprivileged: Path) -> None:
        """Whoever may write in its folder could replace it; but the owner has said that it is not to be written to."""
        output = unprivileged / "new.json"
        output.write_text("earlier")
        output.chmod(0o444)
        with pytest.raises(InputError, match="cannot be written: Permission denied"), replacing(output):
            pass
        assert output.read_text() == "earlier"
        assert os.listdir(unprivileged) == ["new.json"]

    def test_is_known_before_the_work_in_a_folder_for_everybody(self, unprivileged: Path) -> None:
        """As in /tmp: anybody may write the file, but not replace it."""
        shared = unprivileged.parent / "shared"
        user = os.geteuid()
        if os.getuid() != 0:
            pytest.skip("only root can make a file of another user")
        os.seteuid(0)
        shared.mkdir()
        shared.chmod(0o1777)
        (shared / "new.json").write_text("theirs")
        (shared / "new.json").chmod(0o666)
        os.seteuid(user)
        with pytest.raises(InputError, match="Operation not permitted"):
            require_writable(shared / "new.json")
        assert (shared / "new.json").read_text() == "theirs"


class TestNames:
    @pytest.mark.parametrize("letter", ["a", "é", "顔"])
    @pytest.mark.parametrize("length", [240, 249, 255])
    @pytest.mark.parametrize("name", ["interpolate", "interpolate's report", "bake", "compress"])
    def test_of_up_to_255_bytes_are_written(self, name: str, length: int, letter: str, here: Path, run: Run) -> None:
        ending = COMMANDS[name][1]
        count, left = divmod(length - len(ending), len(letter.encode()))
        output = here / f"{letter * count}{'b' * left}{ending}"
        assert len(output.name.encode()) == length
        for _ in range(2):  # the second time it is replaced
            assert run(*command(name, output, here / "other.npz"))[0] == 0
        assert output.stat().st_size > 0

    @pytest.mark.parametrize("name", COMMANDS)
    def test_of_more_are_refused(self, name: str, here: Path, run: Run) -> None:
        before = listing(here)
        ending = COMMANDS[name][1]
        status, said = run(*command(name, "a" * (256 - len(ending)) + ending))
        assert status == 2
        assert is_sentence(said)
        assert "cannot be written: File name too long; choose a shorter name." in said
        assert listing(here) == before

    @pytest.mark.parametrize("name", FOLDER_COMMANDS)
    def test_of_folders(self, name: str, here: Path, run: Run) -> None:
        before = listing(here)
        status, said = run(*folder_command(name, "a" * 256))
        assert status == 2
        assert is_sentence(said)
        assert "File name too long" in said
        assert listing(here) == before

    @pytest.mark.parametrize("name", COMMANDS)
    def test_that_no_system_has(self, name: str, here: Path, run: Run) -> None:
        before = listing(here)
        for odd in ("nul\0.npz", "surrogate\ud800.npz"):
            status, said = run(*command(name, odd))
            assert status == 2
            assert is_sentence(said)
        assert listing(here) == before

    def test_that_blender_would_cut_off(self, here: Path, run: Run) -> None:
        """Blender takes 1023 bytes, the system 4095: what is cut off is the name of another file."""
        deep = here
        while len(str(deep)) < 1050:
            deep = deep / ("d" * min(200, 1050 - len(str(deep))))
        deep.mkdir(parents=True)
        cut = Path(str(deep / "new.blend")[:1023])
        status, said = run(*command("bake", deep / "new.blend"))
        assert status == 2
        assert "is too long for Blender" in said
        assert list(deep.iterdir()) == []
        assert not cut.is_file()


class TestPlacesThatMayNotBeEntered:
    @pytest.mark.parametrize("name", COMMANDS)
    def test_for_an_output(self, name: str, here: Path, unprivileged: Path, run: Run) -> None:
        os.mkdir(unprivileged / "closed", 0o600)
        os.mkdir(unprivileged / "fixed", 0o500)
        for folder in ("closed", "fixed"):
            status, said = run(*command(name, unprivileged / folder / f"new{COMMANDS[name][1]}"))
            assert status == 2
            assert is_sentence(said)
            assert "cannot be written: Permission denied" in said

    @pytest.mark.parametrize("name", FOLDER_COMMANDS)
    def test_for_a_folder(self, name: str, unprivileged: Path, run: Run) -> None:
        os.mkdir(unprivileged / "closed", 0o600)
        os.mkdir(unprivileged / "fixed", 0o500)
        for folder in ("closed/found", "fixed/found"):
            status, said = run(*folder_command(name, unprivileged / folder))
            assert status == 2
            assert is_sentence(said)
            assert "cannot be made a folder: Permission denied" in said

    @pytest.mark.parametrize("name", [*COMMANDS, "analyze", "analyze shapes"])
    def test_for_an_input(self, name: str, unprivileged: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
        os.mkdir(unprivileged / "closed", 0o600)
        if name in FOLDER_COMMANDS:
            arguments = folder_command(name, unprivileged)
        else:
            arguments = command(name, unprivileged / "one", unprivileged / "two")
        inputs = ("bar.npz", "map.npz", "frames.npz", "bar.blend", "baked.blend", "map.qc3d", "frames.qc3d")
        status, said = run(*[unprivileged / "closed" / part if part in inputs else part for part in arguments])
        assert status == 2
        assert is_sentence(said)
        assert "cannot be read: Permission denied" in said

    def test_a_working_folder_that_is_gone(self, here: Path, run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
        (here / "gone").mkdir()
        monkeypatch.chdir(here / "gone")
        (here / "gone").rmdir()
        for name in COMMANDS:
            status, said = run(*command(name, f"new{COMMANDS[name][1]}"))
            assert status == 2
            assert is_sentence(said)


class TestFullDisks:
    @pytest.fixture
    def full(self, small_disk: Path) -> Path:
        """A disk with room for an earlier file, for a folder, and for little more."""
        (small_disk / "earlier").write_bytes(b"earlier")
        return small_disk

    @pytest.mark.parametrize("name", [*COMMANDS])
    def test_without_any_room_the_work_is_not_begun(self, name: str, full: Path, here: Path, run: Run) -> None:
        output = full / f"new{COMMANDS[name][1]}"
        output.write_text("earlier")
        (full / "ballast").write_bytes(bytes(2**20 - 2 * 4096))
        before = listing(full)
        status, said = run(*command(name, output))
        assert status == 2
        assert is_sentence(said)
        assert "cannot be written: No space left on device; make room on that disk" in said
        assert listing(full) == before

    @pytest.mark.parametrize("name", [name for name in COMMANDS if name != "bake"])
    def test_that_get_full_while_it_is_written(self, name: str, full: Path, here: Path, run: Run) -> None:
        output = full / f"new{COMMANDS[name][1]}"
        output.write_text("earlier")
        # Room for the folder and its mark.
        ballast = os.statvfs(full).f_bavail * 4096 - 4096
        (full / "ballast").write_bytes(bytes(ballast))
        before = listing(full)
        others = listing(here)
        status, said = run(*command(name, output, here / "other.npz"))
        assert status == 2
        assert is_sentence(said)
        assert "cannot be written: No space left on device; make room on that disk" in said
        assert listing(full) == before
        assert listing(here) == others

    def test_that_get_full_while_blender_writes(self, full: Path, here: Path, run: Run) -> None:
        assert run(*command("bake", "whole.blend"))[0] == 0
        before = listing(full)
        room = 3 * 4096 + Path("whole.blend").stat().st_size // 2  # the folder, its mark, and half of the file
        (full / "ballast").write_bytes(bytes(os.statvfs(full).f_bavail * 4096 - room))
        status, said = run(*command("bake", full / "new.blend"))
        (full / "ballast").unlink()
        assert status == 2
        assert is_sentence(said)
        assert f"{full / 'new.blend'} cannot be written: No space left on device; make room on that disk" in said
        assert listing(full) == before

    @pytest.mark.parametrize("ending", ["vtu", "vtk", "msh", "npz"])
    def test_in_the_formats_of_others(self, ending: str, full: Path, here: Path, run: Run) -> None:
        (full / "ballast").write_bytes(bytes(os.statvfs(full).f_bavail * 4096 - 4096))
        status, said = run("reconstruct", "map.npz", "--output", full / f"new.{ending}")
        assert status == 2
        assert is_sentence(said)
        assert "cannot be written: No space left on device; make room on that disk" in said

    def test_in_a_folder(self, full: Path, here: Path, run: Run) -> None:
        before = listing(full)
        (full / "ballast").write_bytes(bytes(os.statvfs(full).f_bavail * 4096 - 40_000))
        status, said = run("analyze", "map.npz", "--output", full / "found")
        (full / "ballast").unlink()
        assert status == 2
        assert is_sentence(said)
        assert "cannot be written: No space left on device" in said
        assert listing(full) == before


def test_paths_in_a_blend_file_still_lead_where_they_did(here: Path, run: Run) -> None:
    """They are relative to the folder that the file is in, which is not that of the unfinished one."""
    (here / "textures").mkdir()
    (here / "deep" / "er").mkdir(parents=True)
    bpy.ops.wm.open_mainfile(filepath=str(here / "bar.blend"))
    image = bpy.data.images.new("Skin", 4, 4)
    image.filepath_raw = str(here / "textures" / "skin.png")
    image.file_format = 'PNG'
    image.save()
    image.filepath = "//textures/skin.png"
    image.use_fake_user = True
    bpy.ops.wm.save_as_mainfile(filepath=str(here / "bar.blend"))
    for output in (here / "new.blend", here / "deep" / "er" / "new.blend", here / "bar.blend"):
        assert run(*command("bake", output))[0] == 0
        bpy.ops.wm.open_mainfile(filepath=str(output))
        kept = bpy.data.images["Skin"].filepath
        assert kept.startswith("//")
        assert Path(bpy.path.abspath(kept)).resolve() == here / "textures" / "skin.png"


def test_what_is_written_is_whole(here: Path, run: Run) -> None:
    """The same frames as numpy's own writer would store."""
    assert run(*command("interpolate's report", "report.json", "new.npz"))[0] == 0
    with np.load("new.npz") as stored:
        assert set(stored.files) - {"polygons"} == {"faces", "frames", "key0", "key1", "settings", "times"}
        assert stored["frames"].flags.c_contiguous
    assert json.loads((here / "report.json").read_text())
