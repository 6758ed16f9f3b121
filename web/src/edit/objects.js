// Objects of the scene, as the node sends them: { handle, name, alias, kind, type, parent, pose, values, ... }, with their
// `matrix` in the world.
import { matrixOf } from "./poses.js";

export const WORLD = -1;
const STRUCTURE = ["name", "alias", "type", "parent", "model", "script", "root"]; // keys that the object tree shows

/** @typedef {wire.Row & { matrix: import("three").Matrix4 }} SceneObject */

export class Objects {
  constructor() {
    /** @type {Map<number, SceneObject>} */
    this.rows = new Map(); // by handle
    /** @type {Map<number, wire.Row>} */
    this.told = new Map(); // the rows as the node has sent them, by handle
    /** @type {Map<number, number[]>} */
    this.below = new Map(); // handles of children, by that of their parent
    /** @type {Map<string, number>} */
    this.names = new Map(); // handles, by name
    /** @type {number | null} */
    this.version = null;
  }

  clear() {
    this.rows.clear();
    this.told.clear();
    this.below.clear();
    this.names.clear();
    this.version = null;
  }

  // Apply a change of the tree, whose rows have only the keys that have changed. Return "missed" if an earlier change is
  // missing, "tree" if objects or their STRUCTURE have changed, "" if only poses and values have.
  /** @param {wire.TreeChange} change */
  take({ version, since, objects, gone }) {
    if (since !== null && since !== this.version) return "missed";
    let isNew = gone.length > 0;
    if (since === null) {
      isNew = true;
      this.rows.clear();
      this.told.clear();
    }
    this.version = version;
    for (const handle of gone) for (const all of [this.rows, this.told]) all.delete(handle);
    for (const changed of objects) {
      const before = this.told.get(changed.handle);
      const row = { ...before, ...changed };
      isNew ||= !before || STRUCTURE.some((key) => before[key] !== row[key]);
      this.told.set(row.handle, row);
      this.rows.set(row.handle, { ...row, matrix: matrixOf(row.pose) });
    }
    if (isNew) this.sort();
    return isNew ? "tree" : "";
  }

  sort() {
    this.below.clear();
    this.names.clear();
    for (const { handle, name, parent } of [...this.rows.values()].sort((one, other) => one.handle - other.handle)) {
      const above = this.rows.has(parent) ? parent : WORLD;
      const siblings = this.below.get(above);
      if (siblings) siblings.push(handle);
      else this.below.set(above, [handle]);
      this.names.set(name, handle);
    }
  }

  all() {
    return this.rows.values();
  }

  get(handle) {
    return this.rows.get(handle);
  }

  // Return an object whose handle is known to exist.
  existing(handle) {
    return /** @type {SceneObject} */ (this.rows.get(handle));
  }

  named(name) {
    return this.get(this.names.get(name));
  }

  children(handle) {
    return this.below.get(handle) ?? [];
  }

  // Return the handles of an object's ancestors, the nearest first.
  above(handle) {
    const ancestors = [];
    for (let one = this.get(this.get(handle)?.parent); one; one = this.get(one.parent)) ancestors.push(one.handle);
    return ancestors;
  }

  // Return the handles of an object and of all its descendants.
  withBelow(handle) {
    return [handle, ...this.children(handle).flatMap((one) => this.withBelow(one))];
  }

  // Return those of `handles` that are not descendants of another one.
  roots(handles) {
    const all = new Set(handles);
    return handles.filter((one) => this.rows.has(one) && !this.above(one).some((above) => all.has(above)));
  }

  mayHangOn(handle, parent) {
    return handle !== parent && (parent === WORLD || (this.rows.has(parent) && !this.withBelow(handle).includes(parent)));
  }
}
