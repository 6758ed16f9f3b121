// What is done to what is selected as it lies: dropped to the floor, aligned with the last one, copied in rows.
import * as THREE from "three";
import { onGrid } from "./handles.js";

const AXES = ["x", "y", "z"];
const GAP = 0.2; // m, between what is duplicated
const shifted = (matrix, by) => new THREE.Matrix4().setPosition(by).multiply(matrix);

export class Arrange {
  /** @param {import("./edit.js").Edit} edit */
  constructor(edit) {
    this.edit = edit;
  }

  get roots() {
    return this.edit.objects.roots(this.edit.selected).filter((one) => this.edit.mayMove(one));
  }

  // Each by itself, with its lowest point on z = 0.
  dropToFloor() {
    this.shift("Drop", (box) => new THREE.Vector3(0, 0, -box.min.z));
  }

  // Along an axis, with the low end (-1), the middle (0) or the high end (1) of the last one.
  align(axis, end) {
    const { last } = this.edit;
    if (last === undefined || !this.edit.objects.get(last)) return; // it has just been made, and is not told yet
    const ends = (box) => [box.min, box.getCenter(new THREE.Vector3()), box.max][end + 1].getComponent(axis);
    const to = ends(this.edit.seen.boxOf([last]));
    this.shift(`Align ${AXES[axis]}:`, (box) => new THREE.Vector3().setComponent(axis, to - ends(box)), last);
  }

  shift(verb, by, without) {
    const { edit, roots } = this;
    const moved = roots.filter((one) => one !== without);
    const places = new Map(moved.map((one) => [one, shifted(edit.objects.existing(one).matrix, by(edit.seen.boxOf([one])))]));
    if (places.size) return edit.place(places, edit.named(verb, moved));
  }

  // How far a copy is put aside, so that it does not stand in what it is a copy of: m.
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

