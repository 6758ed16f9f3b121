// Display of the distance between two points that the user clicks on, with its components along the axes.
import * as THREE from "three";
import { ACCENT } from "../scene/looks.js";
import { Words } from "../scene/text.js";

const SIZE = 14; // px, font size

export class Measure {
  constructor(scene) {
    this.scene = scene;
    this.group = new THREE.Group();
    this.points = [];
    this.line = new THREE.Line(new THREE.BufferGeometry(), new THREE.LineBasicMaterial({ color: ACCENT, depthTest: false }));
    this.line.renderOrder = 6;
    this.line.frustumCulled = false;
    this.line.raycast = () => {};
    this.words = new Words("", { size: SIZE, fixed: true });
    this.group.add(this.line, this.words);
    this.group.visible = false;
    scene.world.add(this.group);
  }

  clear() {
    this.points = [];
    this.group.visible = false;
    this.scene.change();
  }

  // Take a point that was clicked on; a third one begins a new measurement.
  take(point) {
    if (this.points.length > 1) this.points = [];
    this.points.push(point.clone());
    this.show(point);
  }

  over(point) {
    if (this.points.length === 1 && point) this.show(point);
  }

  show(to) {
    const [from, end = to] = this.points;
    this.line.geometry.setFromPoints([from, end]);
    const difference = end.clone().sub(from);
    const [x, y, z] = difference.toArray().map((one) => one.toFixed(3));
    this.text = `${difference.length().toFixed(3)} m   (x ${x}, y ${y}, z ${z})`;
    this.words.say(this.text);
    this.words.position.copy(from).lerp(end, 0.5);
    this.group.visible = true;
    this.scene.change();
  }
}
