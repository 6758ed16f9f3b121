// Tree of the frames and of the markers in them, as sent by the node.
import * as THREE from "three";
import { axes } from "./looks.js";
import { change, make, remove } from "./markers.js";
import { Words } from "./text.js";

const WORLD = "world";
const NAME = 11; // px, font size of frame names
const OBJECTS = "scene"; // layer of the scene's objects
const LABELS = "view/state"; // layer of the state texts, which are high above the drone for rviz, whose camera is farther away
const LOW = 0.5; // factor on their height here
const JUMP = 0.5; // m: a frame that moves farther at once was set there, and is not interpolated

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
    this.smooth = 0; // s, duration of the interpolation to a new pose; 0 for none
    this.isMoved = false; // objects have moved; the scene clears the flag
    /** @type {THREE.Object3D[]} */
    this.frames = []; // by index
    /** @type {Map<string, THREE.Object3D>} */
    this.byName = new Map();
    /** @type {Map<number, THREE.Object3D>} */
    this.markers = new Map(); // by id
    /** @type {Map<THREE.Object3D, { from: Place, to: Place, began: number }>} */
    this.moving = new Map(); // frames that are interpolated; start time in ms
    /** @type {Set<THREE.Object3D>} */
    this.waiting = new Set(); // markers whose frame the node has not sent yet
    this.clear();
  }

  clear() {
    for (const object of this.markers.values()) remove(object);
    this.root.clear();
    this.frames = [];
    this.byName = new Map([[WORLD, this.root]]);
    for (const collection of [this.markers, this.moving, this.waiting]) collection.clear();
    this.isNew = true; // frames or markers were added or removed; the scene clears the flag
  }

  // Apply a message of scene_state.py and its numbers: poses first (7 numbers each), then the arrays of the markers.
  /**
   * @param {wire.SceneMessage} message
   * @param {Float32Array} numbers
   */
  take(message, numbers) {
    if (message.whole) this.clear();
    for (const id of message.gone) this.drop(id);
    for (const [index, name, parent] of message.frames) this.hang(index, name, parent);
    let at = 0;
    for (const index of message.moved) this.move(this.frames[index], numbers, 7 * at++);
    let after = 7 * (message.moved.length + message.placed.length);
    for (const marker of /** @type {wire.Marker[]} */ (message.markers)) {
      for (const [name, count] of marker.arrays ?? []) {
        marker[name] = numbers.slice(after, after + count);
        after += count;
      }
      this.put(marker);
    }
    for (const id of message.placed) {
      const object = this.markers.get(id);
      if (object) place(object, numbers, 7 * at);
      this.isMoved ||= object?.userData.said.layer === OBJECTS;
      if (object?.userData.said.layer === LABELS) object.position.multiplyScalar(LOW);
      at++;
    }
    if (message.frames.length) for (const object of [...this.waiting]) this.attach(object);
  }

  hang(index, name, parent) {
    const frame = this.frameAt(index);
    frame.name = name;
    this.byName.set(name, frame);
    (parent < 0 ? this.root : this.frameAt(parent)).add(frame);
    if (this.shows) this.mark(frame);
    this.isNew = true;
  }

  // Return a frame; create it if needed, since a frame may be sent before its parent.
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

  // Interpolate the moving frames at time `now` (ms); return whether any is still moving.
  advance(now) {
    for (const [frame, { from, to, began }] of this.moving) {
      const progress = Math.min(1, (now - began) / (1000 * this.smooth));
      frame.position.lerpVectors(from.position, to.position, progress);
      frame.quaternion.slerpQuaternions(from.quaternion, to.quaternion, progress);
      if (progress === 1) this.moving.delete(frame);
    }
    return this.moving.size > 0;
  }

  put(marker) {
    const before = this.markers.get(marker.id);
    if (before && change(before, marker)) return;
    const object = make(marker, this.changed);
    if (before) {
      object.position.copy(before.position);
      object.quaternion.copy(before.quaternion);
      this.drop(marker.id);
    }
    this.markers.set(marker.id, object);
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

  // Show or hide the axes and names of all frames.
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
