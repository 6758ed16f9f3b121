// The frames, and the markers that hang on them, as the node tells them.
import * as THREE from "three";
import { axes } from "./looks.js";
import { change, make, remove } from "./markers.js";
import { Words } from "./text.js";

const WORLD = "world";
const NAME = 11; // px
const OBJECTS = "scene"; // the layer of what stands around
const LABELS = "view/state"; // which stand high above the drone for rviz, from whose eyes it is farther away
const LOW = 0.5;
const JUMP = 0.5; // m: who moves so far at once was put there

/** @typedef {{ position: THREE.Vector3, quaternion: THREE.Quaternion }} Place */

export class Tree {
  /**
   * @param {THREE.Scene} scene
   * @param {() => void} changed
   */
  constructor(scene, changed) {
    this.root = new THREE.Group();
    scene.add(this.root);
    this.changed = changed;
    this.smooth = 0; // s, in which a frame goes to where it is told to be
    this.isMoved = false; // whether objects have moved since somebody looked
    /** @type {THREE.Object3D[]} */
    this.frames = []; // by index
    /** @type {Map<string, THREE.Object3D>} */
    this.byName = new Map();
    /** @type {Map<number, THREE.Object3D>} */
    this.markers = new Map(); // by id
    /** @type {Map<THREE.Object3D, { from: Place, to: Place, began: number }>} */
    this.moving = new Map(); // frames on their way: where from, where to, since when
    /** @type {Set<THREE.Object3D>} */
    this.waiting = new Set(); // markers whose frame is not known
    this.clear();
  }

  clear() {
    for (const object of this.markers.values()) remove(object);
    this.root.clear();
    this.frames = [];
    this.byName = new Map([[WORLD, this.root]]);
    for (const known of [this.markers, this.moving, this.waiting]) known.clear();
    this.isNew = true; // whether frames or markers have come or gone since somebody looked
  }

  // Takes what scene_state.py tells: `said`, and the numbers (float32) that belong to it.
  /**
   * @param {wire.SceneMessage} said
   * @param {Float32Array} numbers
   */
  take(said, numbers) {
    if (said.whole) this.clear();
    for (const id of said.gone) this.drop(id);
    for (const [index, name, parent] of said.frames) this.hang(index, name, parent);
    let at = 0;
    for (const index of said.moved) this.move(this.frames[index], numbers, 7 * at++);
    let after = 7 * (said.moved.length + said.placed.length);
    for (const one of /** @type {wire.Marker[]} */ (said.markers)) {
      for (const [name, count] of one.arrays ?? []) {
        one[name] = numbers.slice(after, after + count);
        after += count;
      }
      this.put(one);
    }
    for (const id of said.placed) {
      const object = this.markers.get(id);
      if (object) place(object, numbers, 7 * at);
      this.isMoved ||= object?.userData.said.layer === OBJECTS;
      if (object?.userData.said.layer === LABELS) object.position.multiplyScalar(LOW);
      at++;
    }
    if (said.frames.length) for (const object of [...this.waiting]) this.attach(object);
  }

  hang(index, name, parent) {
    const frame = this.frameAt(index);
    frame.name = name;
    this.byName.set(name, frame);
    (parent < 0 ? this.root : this.frameAt(parent)).add(frame);
    if (this.shows) this.mark(frame);
    this.isNew = true;
  }

  // A frame may be told before the one that it hangs on.
  frameAt(index) {
    return (this.frames[index] ??= new THREE.Group());
  }

  move(frame, numbers, at) {
    const from = { position: frame.position.clone(), quaternion: frame.quaternion.clone() };
    place(frame, numbers, at);
    const isNear = frame.userData.isPlaced && from.position.distanceTo(frame.position) < JUMP;
    frame.userData.isPlaced = true;
    this.moving.delete(frame);
    if (!this.smooth || !isNear) return;
    const to = { position: frame.position.clone(), quaternion: frame.quaternion.clone() };
    this.moving.set(frame, { from, to, began: performance.now() });
    frame.position.copy(from.position);
    frame.quaternion.copy(from.quaternion);
  }

  // Lets frames go on; tells whether there are any that have not arrived.
  advance(now) {
    for (const [frame, { from, to, began }] of this.moving) {
      const share = Math.min(1, (now - began) / (1000 * this.smooth));
      frame.position.lerpVectors(from.position, to.position, share);
      frame.quaternion.slerpQuaternions(from.quaternion, to.quaternion, share);
      if (share === 1) this.moving.delete(frame);
    }
    return this.moving.size > 0;
  }

  put(said) {
    const before = this.markers.get(said.id);
    if (before && change(before, said)) return;
    const object = make(said, this.changed);
    if (before) {
      object.position.copy(before.position);
      object.quaternion.copy(before.quaternion);
      this.drop(said.id);
    }
    this.markers.set(said.id, object);
    this.attach(object);
    this.isNew = true;
  }

  attach(object) {
    const frame = this.byName.get(object.userData.said.frame);
    if (frame) {
      frame.add(object);
      this.waiting.delete(object);
    } else this.waiting.add(object);
  }

  drop(id) {
    const object = this.markers.get(id);
    if (!object) return;
    this.markers.delete(id);
    this.waiting.delete(object);
    remove(object);
    this.isNew = true;
  }

  // Shows axes and names of all frames, or none.
  showFrames(shown) {
    if (shown === Boolean(this.shows)) return;
    this.shows = shown;
    for (const frame of this.frames) shown ? this.mark(frame) : frame.userData.mark?.removeFromParent();
  }

  mark(frame) {
    frame.userData.mark ??= axes().add(new Words(frame.name, { size: NAME, fixed: true, plate: "rgba(255,255,255,0.6)" }));
    frame.add(frame.userData.mark);
  }
}

function place(object, numbers, at) {
  object.position.set(numbers[at], numbers[at + 1], numbers[at + 2]);
  object.quaternion.set(numbers[at + 3], numbers[at + 4], numbers[at + 5], numbers[at + 6]);
}
