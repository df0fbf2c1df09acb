// SPDX-FileCopyrightText: 2026 QC3D authors
// SPDX-License-Identifier: GPL-3.0-or-later
//
// A job type for Flamenco 3: runs "qc3d batch JOBS.toml", one task for each part of the jobs.
// Copy it into the folder "scripts" beside the Flamenco Manager; docs/guide/farms.md says more.

const JOB_TYPE = {
    label: "QC3D Batch",
    description: "In-betweens of shape keys, by the jobs of a TOML file",
    settings: [
        { key: "jobs_file", type: "string", subtype: "file_path", required: true,
          description: "The TOML file with the jobs, on storage that all workers see" },
        { key: "parts", type: "int32", default: 1, propargs: { min: 1, max: 10000 },
          description: "Number of tasks that the jobs are divided among" },
        { key: "in_blender", type: "bool", default: true,
          description: "Run in Blender with the QC3D extension; otherwise the command qc3d is run" },
        { key: "program", type: "string", default: "qc3d", visible: "hidden",
          description: "The command qc3d, where it is not run in Blender" },
    ],
};

function compileJob(job) {
    const settings = job.settings;
    if (settings.parts < 1) {
        throw new Error("The number of parts is " + settings.parts + "; give 1 or more.");
    }
    const exe = settings.in_blender ? "{blender}" : settings.program;
    const before = settings.in_blender ? ["--command", "qc3d"] : [];
    for (let part = 1; part <= settings.parts; part++) {
        const share = part + "/" + settings.parts;
        const task = author.Task("part " + share, settings.in_blender ? "blender" : "misc");
        task.addCommand(author.Command("exec", {
            exe: exe,
            args: before.concat(["batch", settings.jobs_file, "--part", share]),
        }));
        job.addTask(task);
    }
}
