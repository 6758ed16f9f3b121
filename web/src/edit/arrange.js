// Operations on the selected objects: drop to the floor, align with the last selected object, copy in rows.
import * as THREE from "three";
import { onGrid } from "./handles.js";

const AXES = ["x", "y", "z"];
const GAP = 0.2; // m, between an object and its duplicate
const shifted = (matrix, by) => new THREE.Matrix4().setPosition(by).multiply(matrix);

export class Arrange {
  /** @param {import("./edit.js").Edit} edit */
  constructor(edit) {
    this.edit = edit;
  }

  get roots() {
    return this.edit.objects.roots(this.edit.selected).filter((one) => this.edit.mayMove(one));
  }

  // Move each selected object vertically so that its lowest point is at z = 0.
  dropToFloor() {
    this.shift("Drop", (box) => new THREE.Vector3(0, 0, -box.min.z));
  }

  // Align the low ends (`end` = -1), middles (0) or high ends (1) along `axis` (0..2) with those of the last selected object.
  align(axis, end) {
    const { last } = this.edit;
    if (last === undefined || !this.edit.objects.get(last)) return; // the object is new, and the node has not sent it yet
    const endOf = (box) => [box.min, box.getCenter(new THREE.Vector3()), box.max][end + 1].getComponent(axis);
    const to = endOf(this.edit.seen.boxOf([last]));
    this.shift(`Align ${AXES[axis]}:`, (box) => new THREE.Vector3().setComponent(axis, to - endOf(box)), last);
  }

  shift(verb, offsetOf, excluded) {
    const { edit, roots } = this;
    const moved = roots.filter((one) => one !== excluded);
    const places = new Map(moved.map((one) => [one, shifted(edit.objects.existing(one).matrix, offsetOf(edit.seen.boxOf([one])))]));
    if (places.size) return edit.place(places, edit.named(verb, moved));
  }

  // Return the distance (m) along x at which a copy does not overlap its original.
  aside() {
    const size = this.edit.seen.boxOf(this.roots).getSize(new THREE.Vector3());
    return Math.max(0.1, onGrid(size.x + GAP));
  }

  /**
   * @param {[number, number, number]} counts
   * @param {[number, number, number]} steps
   */
  duplicate(counts = [2, 1, 1], steps = [this.aside(), 0, 0]) {
    const objects = this.roots;
    if (objects.length) return this.edit.make([{ do: "copy", objects, counts, steps }], this.edit.named("Duplicate", objects), true);
  }

  remove() {
    const { edit } = this;
    const objects = edit.selected.filter((one) => edit.objects.get(one)?.of !== "floor");
    const isModel = objects.some((one) => edit.objects.get(one)?.model);
    if (objects.length) return edit.do([{ do: "remove", objects, ...(isModel ? { below: true } : {}) }], edit.named("Delete", objects));
  }

  group(as) {
    const objects = this.roots;
    if (objects.length) return this.edit.make([{ do: "group", objects, name: as === "model" ? "Model" : this.edit.objects.existing(objects[0]).name, as }], this.edit.named("Group", objects));
  }

  ungroup() {
    const object = this.edit.last;
    if (object !== undefined) return this.edit.make([{ do: "ungroup", object }], this.edit.named("Ungroup", [object]), true);
  }

  attachScript(language) {
    const { last: object, is } = this.edit;
    if (object === undefined) return;
    if (!is.file || is.read_only) return this.edit.wrong("Save the scene first (Ctrl+S): the script becomes a file beside it.");
    return this.edit.do([{ do: "attach_script", object, language }], this.edit.named("Attach a script to", [object]));
  }

  detachScript() {
    const object = this.edit.last;
    if (object !== undefined) return this.edit.do([{ do: "detach_script", object }], this.edit.named("Detach the script of", [object]));
  }
}

