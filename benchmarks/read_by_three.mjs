// SPDX-FileCopyrightText: 2026 QC3D authors
// SPDX-License-Identifier: GPL-3.0-or-later
//
// node read_by_three.mjs FILE TIMES.json OUT.json: the vertices of all meshes, at rest and at times, as three.js shows them.
import fs from "fs";
import * as THREE from "three";
import { FBXLoader } from "three/addons/loaders/FBXLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

globalThis.self = globalThis;
globalThis.window ??= globalThis;
const [file, times, out] = process.argv.slice(2);
const bytes = new Uint8Array(fs.readFileSync(file)).buffer;
let root, clips;
if (file.endsWith(".glb")) {
    const read = await new Promise((done, failed) => new GLTFLoader().parse(bytes, "", done, failed));
    [root, clips] = [read.scene, read.animations];
} else {
    root = new FBXLoader().parse(bytes, "");
    clips = root.animations;
}
const meshes = [];
root.traverse((object) => { if (object.isMesh) meshes.push(object); });

function points(isMoved) {
    root.updateMatrixWorld(true);
    const found = [], point = new THREE.Vector3();
    for (const mesh of meshes) {
        const positions = mesh.geometry.attributes.position;
        for (let i = 0; i < positions.count; i++) {
            if (isMoved) mesh.getVertexPosition(i, point);
            else point.fromBufferAttribute(positions, i);
            point.applyMatrix4(mesh.matrixWorld);
            found.push(point.x, point.y, point.z);
        }
    }
    return found;
}

const rest = points(false);
const mixer = new THREE.AnimationMixer(root);
clips.forEach((clip) => mixer.clipAction(clip).play());
const frames = JSON.parse(fs.readFileSync(times)).map((time) => { mixer.setTime(time); return points(true); });
console.log("three.js", THREE.REVISION);
fs.writeFileSync(out, JSON.stringify({ rest, frames }));
