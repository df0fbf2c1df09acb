# SPDX-FileCopyrightText: 2026 QC3D authors
# SPDX-License-Identifier: GPL-3.0-or-later
"""The files for render farms are valid, and run the command as it is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from openjd import model
from py_mini_racer import MiniRacer

from qc3d_addon.cli import main

# The functions that Flamenco 3 gives to a job type's script.
FLAMENCO = """
const author = {
    Task: (name, type) => {
        const task = {name: name, type: type, commands: []};
        task.addCommand = (command) => { task.commands.push(command); };
        return task;
    },
    Command: (name, parameters) => ({name: name, parameters: parameters}),
};
function compiled(settings) {
    const all = {};
    for (const setting of JOB_TYPE.settings) { all[setting.key] = setting.default; }
    const job = {settings: Object.assign(all, settings), tasks: []};
    job.addTask = (task) => { job.tasks.push(task); };
    compileJob(job);
    return JSON.stringify(job.tasks);
}
"""


@pytest.fixture(scope="module")
def flamenco(repository: Path) -> MiniRacer:
    engine = MiniRacer()
    engine.eval(FLAMENCO + (repository / "tools" / "farm" / "qc3d-batch.js").read_text(encoding="utf-8"))
    return engine


def compiled(flamenco: MiniRacer, **settings: object) -> list[dict[str, Any]]:
    return json.loads(flamenco.eval(f"compiled({json.dumps(settings)})"))


def as_the_command_reads_it(words: list[str]) -> tuple[Path, tuple[int, int]]:
    """What the command's own parser makes of a command line."""
    arguments = main._parser().parse_args(words)
    return arguments.jobs, arguments.part


def test_flamenco_makes_a_task_of_each_part(flamenco: MiniRacer) -> None:
    tasks = compiled(flamenco, jobs_file="/farm/my jobs.toml", parts=3)
    assert [task["name"] for task in tasks] == ["part 1/3", "part 2/3", "part 3/3"]
    for number, task in enumerate(tasks, 1):
        assert task["type"] == "blender"
        (command,) = task["commands"]
        assert command["name"] == "exec"
        assert command["parameters"]["exe"] == "{blender}"
        start, words = command["parameters"]["args"][:2], command["parameters"]["args"][2:]
        assert start == ["--command", "qc3d"]
        assert as_the_command_reads_it(words) == (Path("/farm/my jobs.toml"), (number, 3))


def test_flamenco_without_blender(flamenco: MiniRacer) -> None:
    (task,) = compiled(flamenco, jobs_file="jobs.toml", in_blender=False)
    assert task["type"] == "misc"
    assert task["commands"][0]["parameters"] == {"exe": "qc3d", "args": ["batch", "jobs.toml", "--part", "1/1"]}


def test_flamenco_knows_the_kinds_of_all_settings(flamenco: MiniRacer) -> None:
    job_type = json.loads(flamenco.eval("JSON.stringify(JOB_TYPE)"))
    assert job_type["label"] == "QC3D Batch"
    for setting in job_type["settings"]:
        assert set(setting) <= {"key", "type", "subtype", "required", "default", "description", "propargs", "visible"}
        assert setting["type"] in {"string", "int32", "float", "bool"}
        assert setting.get("subtype", "file_path") in {"file_path", "dir_path", "hashed_file_path"}
        assert setting.get("required") or "default" in setting


def test_the_openjd_template_runs_a_task_of_each_part(repository: Path) -> None:
    template = model.decode_job_template(
        template=model.document_string_to_object(
            document=(repository / "tools" / "farm" / "qc3d-batch.openjd.yaml").read_text(encoding="utf-8"),
            document_type=model.DocumentType.YAML,
        )
    )
    kinds = model.ParameterValueType
    job = model.create_job(
        job_template=template,
        job_parameter_values={
            "JobsFile": model.ParameterValue(type=kinds.PATH, value="/farm/my jobs.toml"),
            "Parts": model.ParameterValue(type=kinds.INT, value="3"),
            "Program": model.ParameterValue(type=kinds.STRING, value="qc3d"),
        },
    )
    (step,) = job.steps
    parts = [task["Part"].value for task in model.StepParameterSpaceIterator(space=step.parameterSpace)]
    assert parts == ["1", "2", "3"]
    run = step.script.actions.onRun
    words = []
    for word in run.args:
        symbols = model.SymbolTable()
        symbols["Param.JobsFile"], symbols["Param.Parts"], symbols["Task.Param.Part"] = "/farm/my jobs.toml", "3", "2"
        words.append(word.resolve(symtab=symbols))
    assert as_the_command_reads_it(words) == (Path("/farm/my jobs.toml"), (2, 3))
