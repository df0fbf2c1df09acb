// SPDX-FileCopyrightText: 2026 QC3D authors
// SPDX-License-Identifier: GPL-3.0-or-later
//
// node read_by_babylon.mjs FILE.glb TIMES.json OUT.json: the vertices of all meshes, at rest and at times, as Babylon.js
// shows them.
import fs from "fs";
import * as BABYLON from "@babylonjs/core";
import "@babylonjs/loaders/glTF/index.js";

const [file, times, out] = process.argv.slice(2);
const scene = new BABYLON.Scene(new BABYLON.NullEngine());
scene.useRightHandedSystem = true;
new BABYLON.FreeCamera("camera", BABYLON.Vector3.Zero(), scene);
const address = "data:model/gltf-binary;base64," + fs.readFileSync(file).toString("base64");
await BABYLON.AppendSceneAsync(address, scene, { pluginExtension: ".glb" });
const meshes = scene.meshes.filter((mesh) => mesh.getTotalVertices() > 0);

function points(isMoved) {
    const found = [];
    for (const mesh of meshes) {
        const matrix = mesh.computeWorldMatrix(true);
        const local = isMoved ? mesh.getPositionData(true, true) : mesh.getVerticesData("position");
        for (let i = 0; i < local.length; i += 3) {
            const point = BABYLON.Vector3.TransformCoordinates(BABYLON.Vector3.FromArray(local, i), matrix);
            found.push(point.x, point.y, point.z);
        }
    }
    return found;
}

const rest = points(false);
const frames = JSON.parse(fs.readFileSync(times)).map((time) => {
    for (const group of scene.animationGroups) {
        group.start(false);
        group.pause();
        group.goToFrame(time * group.targetedAnimations[0].animation.framePerSecond);
    }
    scene.render();
    return points(true);
});
console.log("Babylon.js", BABYLON.Engine.Version);
fs.writeFileSync(out, JSON.stringify({ rest, frames }));
process.exit(0);
