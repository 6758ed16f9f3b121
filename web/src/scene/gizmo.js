// What one drags a thing by: an arrow along each axis, a plate for each plane, a ring that turns it about the vertical.
// It is as large on the screen wherever it is.
import * as THREE from "three";
import { SHAPES } from "./looks.js";

const PIXELS = 140; // of an arrow
const TIP = 1.1; // arrows, to the end of its head
const COLORS = [0xd62828, 0x2b9a3e, 0x2f6fde];
const RING = 0xf08c00;
const LIT = 0xffd43b;
const up = new THREE.Vector3(0, 0, 1);
const unit = (axis) => new THREE.Vector3().setComponent(axis, 1);

export class Gizmo {
  constructor() {
    this.scene = new THREE.Scene();
    this.root = new THREE.Group();
    this.scene.add(this.root);
    this.root.visible = false;
    this.parts = [];
    for (const axis of [0, 1, 2]) this.arrow(axis);
    for (const normal of [0, 1, 2]) this.plate(normal);
    this.ring();
    this.lit = null;
  }

  arrow(axis) {
    const group = new THREE.Group();
    const paint = see(COLORS[axis]);
    const shaft = new THREE.Mesh(SHAPES.cylinder, paint);
    shaft.scale.set(0.035, 0.035, 0.8);
    shaft.position.z = 0.45;
    const head = new THREE.Mesh(SHAPES.cone, paint);
    head.scale.set(0.13, 0.13, 0.24);
    head.position.z = 0.95;
    const grip = new THREE.Mesh(SHAPES.cylinder, see(COLORS[axis], 0));
    grip.scale.set(0.2, 0.2, 0.95);
    grip.position.z = 0.6;
    group.add(shaft, head, grip);
    group.quaternion.setFromUnitVectors(up, unit(axis));
    this.part(group, paint, { kind: "axis", axis });
  }

  plate(normal) {
    const paint = see(COLORS[normal], 0.55);
    const plate = new THREE.Mesh(SHAPES.cube, paint);
    plate.scale.setScalar(0.24).setComponent(normal, 0.004);
    plate.position.setScalar(0.34).setComponent(normal, 0);
    this.part(new THREE.Group().add(plate), paint, { kind: "plane", axis: normal });
  }

  ring() {
    const paint = see(RING);
    const ring = new THREE.Mesh(new THREE.TorusGeometry(0.72, 0.018, 6, 64), paint);
    const grip = new THREE.Mesh(new THREE.TorusGeometry(0.72, 0.08, 6, 48), see(RING, 0));
    this.part(new THREE.Group().add(ring, grip), paint, { kind: "turn", axis: 2 });
  }

  part(group, paint, does) {
    group.userData = { paint, color: paint.color.getHex(), ...does };
    group.traverse((one) => (one.renderOrder = 10));
    this.root.add(group);
    this.parts.push(group);
  }

  get isShown() {
    return this.root.visible;
  }

  // Stands at a place of the world, with a heading; `null` hides it.
  put(place, heading = 0) {
    this.root.visible = Boolean(place);
    if (!place) return;
    this.root.position.copy(place);
    this.root.quaternion.setFromAxisAngle(up, heading);
  }

  // Where its upper end is in the world, null while it is hidden.
  get tip() {
    return this.isShown ? this.root.position.clone().addScaledVector(up, TIP * this.root.scale.z) : null;
  }

  // Returns the part that a ray meets, null for none.
  hit(ray) {
    if (!this.isShown) return null;
    let [found] = ray.intersectObjects(this.parts, true);
    let part = found?.object;
    while (part && !this.parts.includes(part)) part = part.parent;
    return part ?? null;
  }

  light(part) {
    if (part === this.lit) return false;
    for (const one of this.parts) one.userData.paint.color.setHex(one === part ? LIT : one.userData.color);
    this.lit = part;
    return true;
  }

  render(renderer, camera, unit) {
    if (!this.isShown) return;
    this.root.scale.setScalar(PIXELS * unit * camera.position.distanceTo(this.root.position));
    renderer.clearDepth();
    renderer.render(this.scene, camera);
  }
}

function see(color, opacity = 1) {
  const made = new THREE.MeshBasicMaterial({ color, opacity, transparent: true, depthTest: false, side: THREE.DoubleSide });
  made.colorWrite = opacity > 0;
  return made;
}

// One drag of one part: from where it began, and the rays of the mouse, to where the thing is to be.
export class Drag {
  // `part` does something to what stands at `place` with `heading` (rad); `ray` is the one that took it.
  constructor({ kind, axis }, place, heading, ray, camera) {
    this.kind = kind;
    this.place = place.clone();
    this.heading = heading;
    const turn = new THREE.Quaternion().setFromAxisAngle(up, heading);
    this.axis = unit(axis).applyQuaternion(turn);
    this.plane = new THREE.Plane().setFromNormalAndCoplanarPoint(this.normal(camera), this.place);
    this.began = this.meet(ray) ?? this.place.clone();
  }

  // Across which plane the mouse is followed.
  normal(camera) {
    if (this.kind !== "axis") return this.axis;
    const seen = this.place.clone().sub(camera.position).normalize();
    const aside = seen.clone().cross(this.axis); // the plane through the axis that faces who looks
    return aside.lengthSq() > 1e-6 ? aside.cross(this.axis).normalize() : seen;
  }

  meet(ray) {
    return ray.intersectPlane(this.plane, new THREE.Vector3());
  }

  // Returns place and heading for a ray, null where it points past the horizon.
  to(ray) {
    const now = this.meet(ray);
    if (!now) return null;
    const way = now.clone().sub(this.began);
    if (this.kind === "axis") return { place: this.place.clone().addScaledVector(this.axis, way.dot(this.axis)), heading: this.heading };
    if (this.kind === "plane") return { place: this.place.clone().add(way), heading: this.heading };
    const angle = (point) => Math.atan2(point.y - this.place.y, point.x - this.place.x);
    return { place: this.place.clone(), heading: this.heading + angle(now) - angle(this.began) };
  }
}
