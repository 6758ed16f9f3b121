// Links between the edited objects and the meshes in the scene: objects of markers, outlines, bounding boxes.
import * as THREE from "three";
import { ACCENT, isSingleMesh } from "../scene/looks.js";

const HOVERED = 0xffffff;
const ALSO = 0xf4a261; // color of selected objects except the last one
const MOST_LIT = 150; // meshes with an outline in one color

export class Seen {
  /** @param {import("./edit.js").Edit} edit */
  constructor(edit) {
    this.edit = edit;
  }

  get objects() {
    return this.edit.objects;
  }

  // Return the object of a marker or glyph; for a vehicle's body, the root of the vehicle.
  objectOf({ ns, handle, layer }) {
    if (handle !== undefined) return this.objects.get(handle);
    const named = this.objects.named(ns);
    if (named || layer === "scene") return named;
    return [...this.objects.all()].find((one) => one.root && one.vehicle === ns);
  }

  // Return the objects that may have glyphs: all of the scene, and the parts of vehicles that are selected in whole or part.
  bodiless() {
    const vehicles = new Set(this.edit.selected.map((one) => this.objects.get(one)?.vehicle));
    return [...this.objects.all()].filter(({ of, vehicle }) => of === "scene" || (vehicle && vehicles.has(vehicle)));
  }

  /**
   * Return the outlines, as Outline.show() takes them.
   * @returns {[meshes: THREE.Mesh[], color: number, pixels: number][]}
   */
  lit() {
    const { hovered, last, selected } = this.edit;
    /** @type {ReturnType<Seen["lit"]>} */
    const lit = [[this.meshesOf(selected.slice(0, -1)), ALSO, 2.5], [this.meshesOf([last]), ACCENT, 2.5]];
    if (hovered !== undefined && !this.edit.has(hovered)) lit.push([this.meshesOf([hovered]), HOVERED, 1.5]);
    return lit.filter(([meshes]) => meshes.length).map(([meshes, color, pixels]) => [meshes.slice(0, MOST_LIT), color, pixels]);
  }

  // Return the meshes of objects and of all their descendants.
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

  // Return the bounding box of objects with their descendants, along the world's axes; of their origins if there is no mesh.
  boxOf(handles) {
    this.edit.scene.world.updateMatrixWorld();
    const box = new THREE.Box3();
    for (const mesh of this.meshesOf(handles)) box.expandByObject(mesh, true);
    if (!box.isEmpty()) return box;
    for (const one of handles) box.expandByPoint(new THREE.Vector3().setFromMatrixPosition(this.objects.existing(one).matrix));
    return box;
  }
}
