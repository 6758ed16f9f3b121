// What is seen in the scene of the objects: which one is under the mouse, which have an outline, how large they are.
import * as THREE from "three";
import { ACCENT, isSingleMesh } from "../scene/looks.js";

const HOVERED = 0xffffff;
const ALSO = 0xf4a261; // what was selected before the last one
const MOST_LIT = 150; // meshes with an outline

export class Seen {
  /** @param {import("./edit.js").Edit} edit */
  constructor(edit) {
    this.edit = edit;
  }

  get objects() {
    return this.edit.objects;
  }

  // The object of what is shown in the scene: a vehicle's body is its root.
  objectOf({ ns, handle, layer }) {
    if (handle !== undefined) return this.objects.get(handle);
    const named = this.objects.named(ns);
    if (named || layer === "scene") return named;
    return [...this.objects.all()].find((one) => one.root && one.vehicle === ns);
  }

  // What is drawn by Glyphs, where it has no body; the parts of a vehicle while it is selected, or one of them.
  bodiless() {
    const vehicles = new Set(this.edit.selected.map((one) => this.objects.get(one)?.vehicle));
    return [...this.objects.all()].filter(({ of, vehicle }) => of === "scene" || (vehicle && vehicles.has(vehicle)));
  }

  /**
   * What has an outline, as Outline takes it.
   * @returns {[meshes: THREE.Mesh[], color: number, pixels: number][]}
   */
  lit() {
    const { hovered, last, selected } = this.edit;
    /** @type {ReturnType<Seen["lit"]>} */
    const lit = [[this.meshesOf(selected.slice(0, -1)), ALSO, 2.5], [this.meshesOf([last]), ACCENT, 2.5]];
    if (hovered !== undefined && !this.edit.has(hovered)) lit.push([this.meshesOf([hovered]), HOVERED, 1.5]);
    return lit.filter(([meshes]) => meshes.length).map(([meshes, color, pixels]) => [meshes.slice(0, MOST_LIT), color, pixels]);
  }

  // Of objects, and of all that hangs on them.
  meshesOf(handles) {
    const all = new Set(handles.filter((one) => this.objects.get(one)).flatMap((one) => this.objects.withBelow(one)));
    const names = new Set([...all].flatMap((one) => this.namesOf(this.objects.existing(one))));
    const shown = all.size ? this.edit.scene.things().filter((one) => names.has(one.userData.said.ns)) : [];
    /** @type {THREE.Mesh[]} */
    const meshes = [];
    for (const one of [...shown, ...[...all].map((each) => this.edit.glyphs.get(each)).filter(Boolean)]) one.traverse((part) => isSingleMesh(part) && meshes.push(part));
    return meshes;
  }

  /** @param {import("./objects.js").SceneObject} object */
  namesOf({ name, root, vehicle }) {
    return root ? [name, vehicle] : [name];
  }

  // The box about some objects, along the axes of the world.
  boxOf(handles) {
    this.edit.scene.world.updateMatrixWorld();
    const box = new THREE.Box3();
    for (const mesh of this.meshesOf(handles)) box.expandByObject(mesh, true);
    if (!box.isEmpty()) return box;
    for (const one of handles) box.expandByPoint(new THREE.Vector3().setFromMatrixPosition(this.objects.existing(one).matrix));
    return box;
  }
}
