// Handles that move, turn and resize the selected objects, along the axes of the world, of the parent or of the object.
import * as THREE from "three";
import { TransformControls } from "three/addons/controls/TransformControls.js";

const GRID = 0.1; // m
const TURN = Math.PI / 12; // rad, step of a rotation
const LARGER = 0.1; // step of a scale factor
const SIZE = 0.75; // on the screen, relative to the default of three.js

export class Handles {
  // `camera` is the one that shows them; `on.changed(change)` is called during a drag, with the value of `change` below.
  constructor(camera, on) {
    this.scene = new THREE.Scene();
    this.base = new THREE.Group(); // the frame whose axes the handles have
    this.taken = new THREE.Object3D(); // the object that TransformControls moves
    this.scene.add(this.base);
    this.base.add(this.taken);
    this.controls = new TransformControls(camera, null);
    this.controls.space = "local";
    this.controls.size = SIZE;
    this.scene.add(this.controls.getHelper());
    this.on = on;
    this.controls.addEventListener("objectChange", () => this.on.changed(this.change));
    this.isSnapped = true;
    this.began = new THREE.Matrix4(); // pose in the world at the start of the drag
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

  // Show the handles at `place` with the axes of `frame`, a position and a matrix in the world; a null frame hides them.
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

  // The effect of the drag so far: the motion as a matrix in the world, and the scale factors along the handles' axes.
  get change() {
    this.taken.updateWorldMatrix(true, false);
    const { position, quaternion, scale } = this.taken;
    const now = new THREE.Matrix4().compose(position, quaternion, new THREE.Vector3(1, 1, 1)).premultiply(this.base.matrixWorld);
    return { matrix: now.multiply(this.began.clone().invert()), factors: scale.clone() };
  }

  // ---- mouse input; x and y of `at` are from -1 to 1

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

  // `isFree`, while its key is held: off the grid if it is on, else on the grid.
  drag(at, isFree) {
    this.snap(isFree);
    this.controls.pointerMove(pointer(at, -1));
  }

  snap(isFree) {
    const isOnGrid = this.isSnapped !== isFree;
    this.controls.setTranslationSnap(isOnGrid ? GRID : null);
    this.controls.setRotationSnap(isOnGrid ? TURN : null);
    this.controls.setScaleSnap(isOnGrid ? LARGER : null);
  }

  // End the drag; return its effect.
  drop() {
    const { change } = this;
    this.controls.pointerUp(pointer(null, 0));
    return change;
  }

  // End the drag without an effect.
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

/** Return what TransformControls reads of a pointer event; three's types demand a whole event. @returns {any} */
const pointer = (at, button) => ({ x: at?.x, y: at?.y, button });

// Return `value` rounded to the grid.
export const onGrid = (value, step = GRID) => Number((Math.round(value / step) * step).toFixed(6));
