// Mark for the place where a dragged model would land: a ring on the ground, or on the object under the mouse.
import * as THREE from "three";
import { ACCENT } from "../scene/looks.js";

export class Landing {
  constructor(scene) {
    this.scene = scene;
    const material = new THREE.MeshBasicMaterial({ color: ACCENT, depthTest: false, transparent: true, opacity: 0.85, side: THREE.DoubleSide });
    this.mark = new THREE.Group();
    const ring = new THREE.Mesh(new THREE.RingGeometry(0.16, 0.2, 40), material);
    const dot = new THREE.Mesh(new THREE.CircleGeometry(0.04, 24), material);
    this.mark.add(ring, dot);
    this.mark.traverse((one) => {
      one.renderOrder = 6;
      one.raycast = () => {};
    });
    this.mark.visible = false;
    scene.world.add(this.mark);
  }

  // Show the mark at `place` [x, y, z] in the world; null or undefined hides it.
  show(place) {
    if (!place && !this.mark.visible) return;
    this.mark.visible = Boolean(place);
    if (place) this.mark.position.fromArray(place);
    this.scene.change();
  }
}
