// Many objects of one shape, such as boxes, are painted at once: 2000 of them one by one would take longer than a
// step. Each is still there by itself, unseen, for the mouse and for the line about what is selected.
import * as THREE from "three";
import { material } from "./looks.js";

const ENOUGH = 60; // objects, from which on it is worth it
const WHITE = [1, 1, 1, 1];

export class Batch {
  constructor(world) {
    this.group = new THREE.Group();
    world.add(this.group);
    /** @type {[THREE.InstancedMesh, THREE.Object3D[]][]} */
    this.painted = []; // [painted at once, the objects]
  }

  // Takes all markers anew.
  build(markers) {
    for (const [together, objects] of this.painted) {
      for (const { children: [mesh] } of objects) if (mesh) mesh.visible = true;
      together.removeFromParent();
      together.dispose();
    }
    this.painted = [];
    const fit = new Map();
    for (const object of markers) {
      const { layer, color, lit } = object.userData.said;
      const geometry = object.children[0]?.geometry;
      if (layer !== "scene" || color[3] < 1 || lit === false || !geometry?.userData.shared || !object.parent) continue;
      if (!fit.has(geometry)) fit.set(geometry, []);
      fit.get(geometry).push(object);
    }
    for (const objects of fit.values()) if (objects.length >= ENOUGH) this.add(objects);
    this.place();
  }

  add(objects) {
    const together = new THREE.InstancedMesh(objects[0].children[0].geometry, material(WHITE), objects.length);
    const color = new THREE.Color();
    objects.forEach((object, number) => {
      object.children[0].visible = false;
      together.setColorAt(number, color.fromArray(object.userData.said.color));
    });
    together.castShadow = together.receiveShadow = true;
    together.frustumCulled = false;
    together.raycast = () => {};
    this.group.add(together);
    this.painted.push([together, objects]);
  }

  // Puts all where they are now.
  place() {
    for (const [together, objects] of this.painted) {
      objects.forEach((object, number) => {
        object.updateWorldMatrix(true, true);
        together.setMatrixAt(number, object.children[0].matrixWorld);
      });
      together.instanceMatrix.needsUpdate = true;
    }
  }
}
