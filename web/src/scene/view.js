// Where one looks from: behind the drone, freely, or with one of its cameras. Dragging orbits, in every view; behind the
// drone the orbit goes with it.
import * as THREE from "three";

export const FOV = 50; // degrees, upwards
export const BEHIND = "behind";
export const FREE = "free";
const SHARE = 0.25; // of the picture's width that a drone fills
const WIDE = 0.32; // m, a drone with its propellers
const NEAREST = 0.65, FARTHEST = 2.5; // m, of what that comes to
const LOW = 0.36; // rad, from which one looks down
const ABOVE = 0.07; // m: the drone is so far above the middle, and its shadow is in the picture
const CLOSE = 0.12, AWAY = 800; // m, how far one can zoom
const STEEPEST = 1.55; // rad
const WIDE_VIEW = 5, STEEP = 0.5; // m, rad: from where one builds
const EASE = 0.12; // s, in which the eyes come back to a drone that was dragged
const up = new THREE.Vector3(0, 0, 1);
const CAMERA = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), Math.PI); // optical frames look along z

export class View {
  /** @param {THREE.PerspectiveCamera} camera */
  constructor(camera) {
    this.camera = camera;
    this.name = BEHIND;
    this.center = new THREE.Vector3(); // of the orbit, seen from `base` and its heading
    this.base = new THREE.Vector3();
    this.heading = 0;
    this.yaw = this.pitch = 0; // of the orbit, rad
    this.zoom = 1; // of the view behind; of others, m
    this.onFree = () => {}; // the scene hears that the view has become free
    this.isHeld = false; // while a drone is dragged, the eyes do not run after it
    this.reset();
  }

  // Looks from straight behind, close.
  reset() {
    this.yaw = 0; // from behind, to the left
    this.pitch = LOW;
    this.zoom = 1;
    this.center.set(0, 0, -ABOVE);
  }

  // How far away it is from what it looks at, m.
  get distance() {
    if (this.name !== BEHIND) return this.zoom;
    const width = 2 * Math.tan(THREE.MathUtils.degToRad(FOV / 2)) * this.camera.aspect;
    return this.zoom * THREE.MathUtils.clamp(WIDE / SHARE / width, NEAREST, FARTHEST);
  }

  // Where it looks at, in the world.
  get aim() {
    return this.center.clone().applyAxisAngle(up, this.heading).add(this.base);
  }

  // Changes the view, and stays where it is; `frame` is where a camera, or what is followed, is.
  look(name) {
    if (name === this.name) return;
    if (name === FREE) this.free();
    else if (name === BEHIND) this.reset();
    this.name = name;
  }

  free() {
    const { camera } = this;
    const ahead = camera.getWorldDirection(new THREE.Vector3());
    const far = this.name === BEHIND ? this.distance : 2;
    this.base.set(0, 0, 0);
    this.heading = 0;
    this.name = FREE;
    this.center.copy(camera.position).addScaledVector(ahead, far);
    this.pitch = Math.asin(THREE.MathUtils.clamp(-ahead.z, -1, 1));
    this.yaw = Math.atan2(ahead.y, ahead.x);
    this.zoom = far;
  }

  // Follows: `frame` is Track_base, or a camera's own frame; undefined where there is none.
  update(frame, seconds = 0) {
    if (this.name !== BEHIND && this.name !== FREE) return this.see(frame);
    if (this.name === BEHIND && frame && !this.isHeld) this.approach(frame, seconds);
    const yaw = this.heading + this.yaw;
    const level = Math.cos(this.pitch);
    const ahead = new THREE.Vector3(level * Math.cos(yaw), level * Math.sin(yaw), -Math.sin(this.pitch));
    const aim = this.aim;
    this.camera.up.copy(up);
    this.camera.position.copy(aim).addScaledVector(ahead, -this.distance);
    this.camera.lookAt(aim);
    return this.isLate;
  }

  approach(frame, seconds) {
    const place = new THREE.Vector3().setFromMatrixPosition(frame.matrixWorld);
    const ahead = new THREE.Vector3().setFromMatrixColumn(frame.matrixWorld, 0);
    const heading = Math.atan2(ahead.y, ahead.x);
    const share = this.isLate ? 1 - Math.exp(-seconds / EASE) : 1;
    this.base.lerp(place, share);
    this.heading += share * Math.atan2(Math.sin(heading - this.heading), Math.cos(heading - this.heading));
    this.isLate = this.isLate && this.base.distanceTo(place) > 0.01;
  }

  see(frame) {
    if (!frame) return;
    frame.matrixWorld.decompose(this.camera.position, this.camera.quaternion, new THREE.Vector3());
    this.camera.quaternion.multiply(CAMERA);
  }

  hold() {
    this.isHeld = true;
  }

  letGo() {
    this.isHeld = false;
    this.isLate = true;
  }

  // ---- by hand; a camera's view becomes a free one

  orbit(right, down, height) {
    this.ofHand();
    this.yaw -= (2 * Math.PI * right) / height;
    this.pitch = THREE.MathUtils.clamp(this.pitch + (Math.PI * down) / height, -STEEPEST, STEEPEST);
  }

  pan(right, down, height) {
    this.ofHand();
    const metres = (2 * this.distance * Math.tan(THREE.MathUtils.degToRad(FOV / 2))) / height;
    const [x, y] = [0, 1].map((axis) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, axis));
    const way = x.multiplyScalar(-right * metres).addScaledVector(y, down * metres);
    this.center.add(way.applyAxisAngle(up, -this.heading));
  }

  approachBy(factor) {
    this.ofHand();
    const before = this.distance;
    this.zoom *= THREE.MathUtils.clamp(before * factor, CLOSE, AWAY) / before;
  }

  // Goes back and up, to see what is about it.
  stepBack() {
    this.zoom = Math.max(this.zoom, WIDE_VIEW);
    this.pitch = Math.max(this.pitch, STEEP);
  }

  ofHand() {
    if (this.name === BEHIND || this.name === FREE) return;
    this.free();
    this.onFree();
  }

  // Looks at a ball of the world, from where one is, near enough to see it well.
  lookAt(place, radius) {
    this.ofHand();
    if (this.name === BEHIND) {
      this.free();
      this.onFree();
    }
    this.center.copy(place);
    this.zoom = THREE.MathUtils.clamp(4 * radius, 0.5, 60);
  }
}
