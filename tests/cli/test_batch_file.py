# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The file of ``qc3d batch``: what its jobs are, and one sentence with the line for everything that is wrong."""

from __future__ import annotations

from pathlib import Path

import pytest

from qc3d_addon.cli import main
from qc3d_addon.cli.batch.toml_lines import lines_of

JOB = '[[job]]\nfile = "a.blend"\nobject = "Body"\nall-keys = true\noutput = "out/{name}.blend"\n'


def listed(folder: Path, text: str, capsys: pytest.CaptureFixture[str], *files: str) -> tuple[int, str, str]:
    """The exit status of a dry run, what it says, and its error."""
    for file in files:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(b"some")
    (folder / "jobs.toml").write_text(text, encoding="utf-8")
    before = sorted(folder.rglob("*"))
    status = main.main(["batch", str(folder / "jobs.toml"), "--dry-run"])
    assert sorted(folder.rglob("*")) == before
    said = capsys.readouterr()
    return status, said.out.replace(f"{folder}/", ""), said.err.replace(f"{folder}/", "")


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "jobs.toml: it has no job; begin each with a line [[job]]"),
        ("[[job]\n", "jobs.toml is no valid TOML: "),
        ("[[job]]\nfile = body.blend\n", "(at line 2, column 8)"),
        ("jobs = 3\n" + JOB, "jobs.toml, line 1: there is no key 'jobs' in this file; did you mean 'job'?"),
        ("[job]\nfile = 'a.blend'\n", "jobs.toml, line 1: it has no job; begin each with a line [[job]]"),
        ("[[job]]\noutput = 'b.blend'\n", "line 1: job 1 has no file; add the line file = "),
        ("[[job]]\nfile = 'a.blend'\nobject = 'A'\nall-keys = true\n", "line 1: job 1 has no output; add the line"),
        (
            JOB + "framse = 3\n",
            "line 6: there is no key 'framse' in job 1, a job of qc3d bake; did you mean 'frames'?\n",
        ),
        (JOB + "all_objects = true\n", "did you mean 'all-objects'?"),
        (JOB + "zzz = 1\n", "there are command, name, file, output, report, in-place, then, object, "),
        (JOB + JOB.replace("a.", "b.") + "qualty = 'fine'\n", "line 11: there is no key 'qualty' in job 2"),
        (JOB + "frames = true\n", "line 6: frames takes no value True; a text in quotes or a number is needed"),
        (JOB + "frames = 2.5\n", "line 6: job 1: frames: '2.5' is not a whole number"),
        (JOB + "frames = [2, 3]\n", "line 6: frames takes one value, not a list"),
        (JOB + "quality = 'best'\n", "line 6: job 1: quality: invalid choice: 'best'"),
        (JOB + "together = 'yes'\n", "line 6: together is true or false"),
        (JOB + "on-key = 'Smile'\n", "line 1: job 1: Name the keys in one way: from and to, on-key"),
        (JOB + "frames = 3\ntolerance = 0.1\n", "job 1: tolerance: not allowed with argument frames"),
        (JOB + "command = 'bakes'\n", "line 6: there is no command 'bakes' for jobs; did you mean 'bake'?"),
        (JOB.replace("{name}", "{nam}"), "line 5: {nam} in output stands for nothing; {name} stands for the file's"),
        (JOB + "in-place = true\n", "line 6: a job in-place has no output of its own; leave one of both out"),
        (JOB + JOB, "line 10: 'out/a.blend' writes the same file as 'out/a.blend'; give it another output"),
        (JOB.replace("out/{name}", "a"), "line 5: a.blend is the file of 'a.blend', which is never replaced; choose"),
        (
            JOB.replace("out/{name}.blend", "jobs.toml"),
            "line 5: jobs.toml is jobs.toml itself, which is never replaced",
        ),
        (JOB + "report = 'out/a.blend'\n", "line 6: the output and the report are one file; give them two names"),
        (JOB + "name = 'x'\n" + JOB.replace("out/", "to/") + "name = 'x'\n", "line 12: two jobs are named 'x'"),
        (JOB.replace("a.blend", "*.none"), "line 2: no file matches '*.none'"),
        (JOB + "[[job.then]]\nfile = 'x'\n", "line 7: a job under [[job.then]] reads what the job before wrote"),
        (
            JOB + "[[job.then]]\ncommand = 'export'\nobject = 'A'\nobjct = 'B'\noutput = 'a.glb'\n",
            "line 9: there is no",
        ),
        ("[defaults]\nframe = 3\n" + JOB, "line 2: there is no key 'frame' in the defaults; did you mean 'frames'?"),
        ("[defaults]\nfile = 'b.blend'\n" + JOB, "line 2: there is no key 'file' in the defaults"),
        ("[defaults]\nframes = 'x'\n" + JOB, "line 3: job 1: frames: 'x' is not a whole number"),
        (JOB + "command = 'export'\n", "line 4: there is no key 'all-keys' in job 1, a job of qc3d export"),
        (
            JOB.replace("all-keys = true", "") + "command = 'export'\nreport = 'r.json'\n",
            "writes no report; leave it out",
        ),
    ],
)
def test_one_sentence_for_what_is_wrong(
    text: str, sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, said, error = listed(tmp_path, text, capsys)
    assert (status, said) == (2, "")
    assert sentence in error
    assert error.count("\n") == 1


def test_patterns_defaults_and_following_jobs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = """
[defaults]
frames = 4
quality = "fine"
all-keys = true

[[job]]
file = "faces/*.blend"
all-objects = true
output = "faces/{name}_baked.blend"
report = "out/{name}.json"

[[job.then]]
command = "export"
object = "Body of 'A'"
output = "out/{name}.glb"

[[job]]
name = "arm of {name}"
file = "arm.blend"
object = ["Arm", "Sleeve"]
all-keys = false
from = "Basis"
via = ["-A", "B"]
via-at = [0.25, 0.5]
to = "Bend"
tolerance = 0.01
in-place = true
"""
    files = ["faces/b.blend", "faces/a.blend", "faces/a_baked.blend", "arm.blend"]
    status, said, error = listed(tmp_path, text, capsys, *files)
    assert (status, error) == (0, "")
    both = "--all-objects --frames=4 --quality=fine --all-keys"
    assert said.splitlines() == [
        "1. faces/a_baked.blend: would run",
        f"   qc3d bake {both} --output=faces/a_baked.blend --report=out/a.json -- faces/a.blend",
        "2. out/a.glb: would run after job 1",
        """   qc3d export '--object=Body of '"'"'A'"'"'' --output=out/a.glb -- faces/a_baked.blend""",
        "3. faces/b_baked.blend: would run",
        f"   qc3d bake {both} --output=faces/b_baked.blend --report=out/b.json -- faces/b.blend",
        "4. out/b.glb: would run after job 3",
        """   qc3d export '--object=Body of '"'"'A'"'"'' --output=out/b.glb -- faces/b_baked.blend""",
        "5. arm of arm: would run",
        "   qc3d bake --object=Arm --object=Sleeve --from=Basis --via=-A --via=B --via-at 0.25 0.5 --to=Bend "
        "--tolerance=0.01 --quality=fine --output=arm.blend -- arm.blend",
        "5 jobs, 5 to do.",
    ]


def test_every_option_of_the_commands_can_be_given(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = """
[[job]]
file = "a.blend"
object = "Body"
combine = [["A", "B"], ["A", "B", "C"]]
output = "1.blend"
[[job]]
file = "a.blend"
object = "Body"
combine = ["A", "B"]
output = "2.blend"
[[job]]
command = "combine"
file = "a.npz"
rest = "R"
outer = "O"
inner = "I"
weights = [0.5, 1]
find-order = true
output = "3.npz"
"""
    status, said, _ = listed(tmp_path, text, capsys, "a.blend")
    assert status == 0
    assert "--combine A B --combine A B C --output=1.blend" in said
    assert "--combine A B --output=2.blend" in said
    assert "qc3d combine --rest=R --outer=O --inner=I --weights 0.5 1 --find-order --output=3.npz -- a.npz" in said
    assert "3. 3.npz: would fail: its file is missing" in said


@pytest.mark.parametrize(
    ("choice", "numbers"),
    [
        (["--part", "1/2"], [1, 2, 4]),
        (["--part", "2/2"], [3]),
        (["--part", "4/4"], []),
        (["--only", "3"], [3]),
        (["--only", "c.glb"], [1, 2]),
        (["--only", "b.blend", "--only", "1"], [1, 3]),
    ],
)
def test_some_of_the_jobs(
    choice: list[str], numbers: list[int], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    jobs = [JOB.replace("out/{name}", name) for name in ("a1", "b", "d")]
    jobs[0] += "[[job.then]]\ncommand = 'export'\nobject = 'Body'\noutput = 'c.glb'\n"
    path = tmp_path / "jobs.toml"
    path.write_text("".join(jobs))
    assert main.main(["batch", str(path), "--dry-run", *choice]) == 0
    said = capsys.readouterr().out.splitlines()
    assert [int(line.split(".")[0]) for line in said if line[0].isdigit() and ". " in line] == numbers


@pytest.mark.parametrize(
    ("choice", "sentence"),
    [
        (["--part", "3/2"], "there is no part 3/2"),
        (["--part", "half"], "'half' is not a part such as 2/5"),
        (["--only", "x"], "There is no job 'x'; --dry-run lists them."),
        (["--processes", "0"], "0 is not possible; give 1 or more"),
        (["--dask", "tcp://x", "--processes", "2"], "its workers decide about processes and memory"),
    ],
)
def test_unusable_options(choice: list[str], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "jobs.toml").write_text(JOB)
    assert main.main(["batch", str(tmp_path / "jobs.toml"), *choice]) == 2
    assert sentence in capsys.readouterr().err


def test_lines_are_those_of_tables_and_keys() -> None:
    text = '''# [[job]]
[defaults]  # of all
note = """
[[job]]
frames = 1
"""
[[job]]
"quoted key" = "[[job]]"
list = [
  ["a"],
  "frames = 3",
]
frames = 2
  [[job.then]]
  frames = 3
[[job]]
'plain' = { frames = 4 }
'''
    assert lines_of(text) == {
        ("defaults",): 2,
        ("defaults", "note"): 3,
        ("job", 0): 7,
        ("job", 0, "quoted key"): 8,
        ("job", 0, "list"): 9,
        ("job", 0, "frames"): 13,
        ("job", 0, "then", 0): 14,
        ("job", 0, "then", 0, "frames"): 15,
        ("job", 1): 16,
        ("job", 1, "plain"): 17,
    }
