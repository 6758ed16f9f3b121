// Instanced drawing of objects of one shape, such as boxes: 2000 separate draw calls would take longer than a time step.
// The single meshes stay in the scene, invisible, for picking and for outlines.
import * as THREE from "three";
import { material } from "./looks.js";

const MIN_OBJECTS = 60; // objects of one shape; fewer are drawn one by one
const WHITE = [1, 1, 1, 1];

export class Batch {
  constructor(world) {
    this.group = new THREE.Group();
    world.add(this.group);
    /** @type {[THREE.InstancedMesh, THREE.Object3D[]][]} */
    this.painted = []; // [instanced mesh, its objects]
  }

  // Rebuild the batches from all markers.
  build(markers) {
    for (const [instanced, objects] of this.painted) {
      for (const { children: [mesh] } of objects) if (mesh) mesh.visible = true;
      instanced.removeFromParent();
      instanced.dispose();
    }
    this.painted = [];
    const byGeometry = new Map();
    for (const object of markers) {
      const { layer, color, lit } = object.userData.said;
      const geometry = object.children[0]?.geometry;
      if (layer !== "scene" || color[3] < 1 || lit === false || !geometry?.userData.shared || !object.parent) continue;
      if (!byGeometry.has(geometry)) byGeometry.set(geometry, []);
      byGeometry.get(geometry).push(object);
    }
    for (const objects of byGeometry.values()) if (objects.length >= MIN_OBJECTS) this.add(objects);
    this.place();
  }

  add(objects) {
    const instanced = new THREE.InstancedMesh(objects[0].children[0].geometry, material(WHITE), objects.length);
    const color = new THREE.Color();
    objects.forEach((object, index) => {
      object.children[0].visible = false;
      instanced.setColorAt(index, color.fromArray(object.userData.said.color));
    });
    instanced.castShadow = instanced.receiveShadow = true;
    instanced.frustumCulled = false;
    instanced.raycast = () => {};
    this.group.add(instanced);
    this.painted.push([instanced, objects]);
  }

  // Copy the objects' current world matrices to the instances.
  place() {
    for (const [instanced, objects] of this.painted) {
      objects.forEach((object, index) => {
        object.updateWorldMatrix(true, true);
        instanced.setMatrixAt(index, object.children[0].matrixWorld);
      });
      instanced.instanceMatrix.needsUpdate = true;
    }
  }
}
