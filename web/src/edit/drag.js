// A drag of the selected objects: shown at once, sent to the node at intervals, and a single step of undo.
import * as THREE from "three";

const PERIOD = 120; // ms between two moves that are sent to the node
const IDENTITY = new THREE.Matrix4().elements.join();
let drags = 0;
const page = Math.random().toString(36).slice(2); // random name of this page, for keys of drags

export class Drag {
  // Begin a drag of the objects `roots` with all their descendants.
  /**
   * @param {import("./edit.js").Edit} edit
   * @param {number[]} roots
   */
  constructor(edit, roots) {
    this.edit = edit;
    this.roots = roots;
    this.change = { matrix: new THREE.Matrix4(), factors: null };
    this.merge = `${page}-${++drags}`;
    this.from = new Map(roots.map((one) => [one, edit.objects.existing(one).matrix.clone()]));
    this.shown = roots.flatMap((root) => this.visualsOf(root));
  }

  // Return [object of the picture, its matrix in the world, root] for the root and all its descendants.
  visualsOf(root) {
    const { objects, scene, glyphs } = this.edit;
    const all = objects.withBelow(root);
    const names = new Set(all.map((one) => objects.existing(one)).filter(({ of }) => of === "scene").map(({ name }) => name));
    const markers = [...scene.tree.markers.values()].filter(({ userData: { said } }) => said.layer === "scene" && names.has(said.ns));
    return [...markers, ...all.map((one) => glyphs.get(one)).filter(Boolean)].map((one) => [one, one.matrixWorld.clone(), root]);
  }

  // Apply `change`: a motion as a matrix in the world, and scale factors along each root's own axes, null for none.
  go(change) {
    this.change = change;
    this.edit.scene.change();
    if (this.isResize(change)) return;
    this.saying ??= setTimeout(() => this.tell(this.change).then(() => (this.saying = undefined)), PERIOD);
  }

  isResize({ factors }) {
    return Boolean(factors) && factors.toArray().some((one) => one !== 1);
  }

  // Show the objects where they will be, before each frame: the node's answer comes later.
  show({ matrix, factors } = this.change) {
    for (const [object, from, root] of this.shown) {
      const motion = matrix.clone();
      const own = this.from.get(root);
      if (factors && own) motion.multiply(own.clone().scale(factors).multiply(own.clone().invert()));
      const local = from.clone().premultiply(motion).premultiply(object.parent.matrixWorld.clone().invert());
      if (!object.matrixAutoUpdate) object.matrix.copy(local);
      local.decompose(object.position, object.quaternion, object.scale);
      object.matrixWorldNeedsUpdate = true;
    }
    this.edit.scene.tree.isMoved = true;
  }

  tell({ matrix }) {
    if (this.isOver) return Promise.resolve();
    this.isTold = true;
    const places = new Map([...this.from].map(([handle, from]) => [handle, from.clone().premultiply(matrix)]));
    return this.edit.place(places, this.edit.named("Move", this.roots), this.merge);
  }

  async end(change) {
    clearTimeout(this.saying);
    for (const [object] of this.shown) object.scale.setScalar(1);
    const { edit, roots } = this;
    const isMoved = this.isTold || change.matrix.elements.join() !== IDENTITY;
    /** @type {wire.Scale} */
    const resize = { do: "scale", objects: roots, factors: change.factors?.toArray().map((one) => Number(one.toFixed(6))) };
    const done = this.isResize(change) ? await edit.do([resize], edit.named("Resize", roots)) : isMoved && (await this.tell(change));
    this.isOver = true;
    if (done === undefined) this.back();
  }

  cancel() {
    clearTimeout(this.saying);
    this.back();
    this.isOver = true;
    if (this.isTold) this.edit.undo("undo", this.merge);
  }

  back() {
    this.show({ matrix: new THREE.Matrix4(), factors: null });
    this.edit.scene.change();
  }
}
