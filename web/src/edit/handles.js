// Handles that move, turn and resize what is selected, along the axes of the world, of its parent or of itself.
import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";

const GRID = 0.1; // m
const TURN = Math.PI / 12; // rad
const LARGER = 0.1; // of a size
const SIZE = 0.75;

export class Handles {
  // `camera` sees them; `on.changed(change)` hears what a drag has done so far, as `change` says.
  constructor(camera, on) {
    this.scene = new THREE.Scene();
    this.base = new THREE.Group(); // the axes along which it goes
    this.taken = new THREE.Object3D(); // what the handles hold
    this.scene.add(this.base);
    this.base.add(this.taken);
    this.controls = new TransformControls(camera, null);
    this.controls.space = "local";
    this.controls.size = SIZE;
    this.scene.add(this.controls.getHelper());
    this.on = on;
    this.controls.addEventListener("objectChange", () => this.on.changed(this.change));
    this.isSnapped = true;
    this.began = new THREE.Matrix4(); // where the drag has begun
  }

  get isDragging() {
    return this.controls.dragging;
  }

  set mode(mode) {
    this.controls.mode = mode;
  }

  get mode() {
    return this.controls.mode;
  }

  // Stands at a place with the axes of a frame, both matrices of the world; null hides them.
  put(frame, place) {
    if (this.isDragging) return;
    if (!frame) return void this.controls.detach();
    frame.decompose(this.base.position, this.base.quaternion, this.base.scale);
    this.base.updateMatrixWorld();
    this.taken.position.copy(place).applyMatrix4(this.base.matrixWorld.clone().invert());
    this.taken.quaternion.identity();
    this.taken.scale.setScalar(1);
    this.taken.updateMatrixWorld();
    if (this.controls.object !== this.taken) this.controls.attach(this.taken);
  }

  // What the drag has done so far: a matrix of the world, and how many times as large it is along its axes.
  get change() {
    this.taken.updateWorldMatrix(true, false);
    const { position, quaternion, scale } = this.taken;
    const now = new THREE.Matrix4().compose(position, quaternion, new THREE.Vector3(1, 1, 1)).premultiply(this.base.matrixWorld);
    return { matrix: now.multiply(this.began.clone().invert()), factors: scale.clone() };
  }

  // ---- the mouse, at x and y from -1 to 1

  hover(at) {
    if (this.controls.object) this.controls.pointerHover(at);
    return this.controls.axis !== null;
  }

  take(at, isFree) {
    if (!this.hover(at)) return false;
    this.began = this.taken.matrixWorld.clone();
    this.snap(isFree);
    this.controls.pointerDown(pointer(at, 0));
    return this.isDragging;
  }

  // `isFree`: without the grid, while its key is held.
  drag(at, isFree) {
    this.snap(isFree);
    this.controls.pointerMove(pointer(at, -1));
  }

  snap(isFree) {
    const snaps = this.isSnapped !== isFree;
    this.controls.setTranslationSnap(snaps ? GRID : null);
    this.controls.setRotationSnap(snaps ? TURN : null);
    this.controls.setScaleSnap(snaps ? LARGER : null);
  }

  // Lets go; returns what the drag has done.
  drop() {
    const { change } = this;
    this.controls.pointerUp(pointer(null, 0));
    return change;
  }

  // Lets go, as if nothing had been done.
  cancel() {
    this.controls.reset();
    this.controls.pointerUp(pointer(null, 0));
  }

  render(renderer, camera) {
    if (!this.controls.object) return;
    this.scene.updateMatrixWorld();
    renderer.clearDepth();
    renderer.render(this.scene, camera);
  }
}

/** What the controls read of a pointer; three's types say that it is an event. @returns {any} */
const pointer = (at, button) => ({ x: at?.x, y: at?.y, button });

// A number on the grid.
export const onGrid = (value, step = GRID) => Number((Math.round(value / step) * step).toFixed(6));
