// Camera of the scene: behind the drone, free, or at one of the drone's cameras. Dragging orbits in every view; behind the
// drone the orbit follows it, and a drone's camera becomes a free view.
import * as THREE from "three";

export const FOV = 50; // degrees, vertical
export const BEHIND = "behind";
export const FREE = "free";
const SHARE = 0.25; // of the picture's width, filled by a drone
const WIDE = 0.32; // m, width of a drone with its propellers
const NEAREST = 0.65, FARTHEST = 2.5; // m, limits of the resulting distance
const LOW = 0.36; // rad, downward pitch of the view from behind
const ABOVE = 0.07; // m from the picture's center up to the drone, so that its shadow is visible
const CLOSE = 0.12, AWAY = 800; // m, limits of the distance when zooming
const STEEPEST = 1.55; // rad, limit of the pitch
const WIDE_VIEW = 5, STEEP = 0.5; // m, rad: least distance and pitch for an overview
const EASE = 0.12; // s, time constant of the camera's return to a drone that was dragged
const up = new THREE.Vector3(0, 0, 1);
const CAMERA = new THREE.Quaternion().setFromAxisAngle(new THREE.Vector3(1, 0, 0), Math.PI); // optical frames look along +z

export class View {
  /** @param {THREE.PerspectiveCamera} camera */
  constructor(camera) {
    this.camera = camera;
    this.name = BEHIND;
    this.center = new THREE.Vector3(); // of the orbit, relative to `base` and turned by `heading`
    this.base = new THREE.Vector3();
    this.heading = 0; // rad
    this.yaw = this.pitch = 0; // of the orbit, rad; yaw is relative to the heading
    this.zoom = 1; // distance in m; in the view from behind a factor
    this.onFree = () => {}; // called when user input makes the view free
    this.isHeld = false; // while a drone is dragged, the camera does not follow it
    this.reset();
  }

  // Move the orbit straight behind the drone, close to it.
  reset() {
    this.yaw = 0; // straight behind
    this.pitch = LOW;
    this.zoom = 1;
    this.center.set(0, 0, -ABOVE);
  }

  // The camera's distance from the aim, m.
  get distance() {
    if (this.name !== BEHIND) return this.zoom;
    const width = 2 * Math.tan(THREE.MathUtils.degToRad(FOV / 2)) * this.camera.aspect;
    return this.zoom * THREE.MathUtils.clamp(WIDE / SHARE / width, NEAREST, FARTHEST);
  }

  // The point in the world that the camera looks at.
  get aim() {
    return this.center.clone().applyAxisAngle(up, this.heading).add(this.base);
  }

  // Switch to the view `name`. The free view begins at the camera's current pose.
  look(name) {
    if (name === this.name) return;
    if (name === FREE) this.free();
    else if (name === BEHIND) this.reset();
    this.name = name;
  }

  free() {
    const { camera } = this;
    const ahead = camera.getWorldDirection(new THREE.Vector3());
    const distance = this.name === BEHIND ? this.distance : 2;
    this.base.set(0, 0, 0);
    this.heading = 0;
    this.name = FREE;
    this.center.copy(camera.position).addScaledVector(ahead, distance);
    this.pitch = Math.asin(THREE.MathUtils.clamp(-ahead.z, -1, 1));
    this.yaw = Math.atan2(ahead.y, ahead.x);
    this.zoom = distance;
  }

  // Update the camera; `frame` is Track_base or a drone's camera, if known. Return whether it is still returning to a drone.
  update(frame, seconds = 0) {
    if (this.name !== BEHIND && this.name !== FREE) return this.see(frame);
    const follows = this.name === BEHIND && frame && !this.isHeld;
    if (follows) this.approach(frame, seconds);
    const yaw = this.heading + this.yaw;
    const level = Math.cos(this.pitch);
    const ahead = new THREE.Vector3(level * Math.cos(yaw), level * Math.sin(yaw), -Math.sin(this.pitch));
    const aim = this.aim;
    this.camera.up.copy(up);
    this.camera.position.copy(aim).addScaledVector(ahead, -this.distance);
    this.camera.lookAt(aim);
    return follows && this.isLate;
  }

  approach(frame, seconds) {
    const position = new THREE.Vector3().setFromMatrixPosition(frame.matrixWorld);
    const ahead = new THREE.Vector3().setFromMatrixColumn(frame.matrixWorld, 0);
    const heading = Math.atan2(ahead.y, ahead.x);
    const share = this.isLate ? 1 - Math.exp(-seconds / EASE) : 1;
    this.base.lerp(position, share);
    this.heading += share * Math.atan2(Math.sin(heading - this.heading), Math.cos(heading - this.heading));
    this.isLate = this.isLate && this.base.distanceTo(position) > 0.01;
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

  // ---- user input, which makes the view of a drone's camera free

  orbit(right, down, height) {
    this.ofHand();
    this.yaw -= (2 * Math.PI * right) / height;
    this.pitch = THREE.MathUtils.clamp(this.pitch + (Math.PI * down) / height, -STEEPEST, STEEPEST);
  }

  pan(right, down, height) {
    this.ofHand();
    const metres = (2 * this.distance * Math.tan(THREE.MathUtils.degToRad(FOV / 2))) / height;
    const [x, y] = [0, 1].map((axis) => new THREE.Vector3().setFromMatrixColumn(this.camera.matrixWorld, axis));
    const offset = x.multiplyScalar(-right * metres).addScaledVector(y, down * metres);
    this.center.add(offset.applyAxisAngle(up, -this.heading));
  }

  approachBy(factor) {
    this.ofHand();
    const before = this.distance;
    this.zoom *= THREE.MathUtils.clamp(before * factor, CLOSE, AWAY) / before;
  }

  // Move back and up for an overview.
  stepBack() {
    this.zoom = Math.max(this.zoom, WIDE_VIEW);
    this.pitch = Math.max(this.pitch, STEEP);
  }

  ofHand() {
    if (this.name === BEHIND || this.name === FREE) return;
    this.free();
    this.onFree();
  }

  // Look at a sphere in the world (radius in m) from the current direction, near enough to see it well.
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
