// Handles for dragging in flight mode: an arrow along each axis, a plate for each plane, a ring to turn about the
// vertical. Their size on the screen is constant.
import * as THREE from "three";
import { SHAPES } from "./looks.js";

const PIXELS = 140; // on the screen per unit of the gizmo, which is about the length of an arrow
const TIP = 1.1; // units, from the center to just above the upper arrow
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
    const paint = overlayMaterial(COLORS[axis]);
    const shaft = new THREE.Mesh(SHAPES.cylinder, paint);
    shaft.scale.set(0.035, 0.035, 0.8);
    shaft.position.z = 0.45;
    const head = new THREE.Mesh(SHAPES.cone, paint);
    head.scale.set(0.13, 0.13, 0.24);
    head.position.z = 0.95;
    const grip = new THREE.Mesh(SHAPES.cylinder, overlayMaterial(COLORS[axis], 0));
    grip.scale.set(0.2, 0.2, 0.95);
    grip.position.z = 0.6;
    group.add(shaft, head, grip);
    group.quaternion.setFromUnitVectors(up, unit(axis));
    this.part(group, paint, { kind: "axis", axis });
  }

  plate(normal) {
    const paint = overlayMaterial(COLORS[normal], 0.55);
    const plate = new THREE.Mesh(SHAPES.cube, paint);
    plate.scale.setScalar(0.24).setComponent(normal, 0.004);
    plate.position.setScalar(0.34).setComponent(normal, 0);
    this.part(new THREE.Group().add(plate), paint, { kind: "plane", axis: normal });
  }

  ring() {
    const paint = overlayMaterial(RING);
    const ring = new THREE.Mesh(new THREE.TorusGeometry(0.72, 0.018, 6, 64), paint);
    const grip = new THREE.Mesh(new THREE.TorusGeometry(0.72, 0.08, 6, 48), overlayMaterial(RING, 0));
    this.part(new THREE.Group().add(ring, grip), paint, { kind: "turn", axis: 2 });
  }

  part(group, paint, action) {
    group.userData = { paint, color: paint.color.getHex(), ...action };
    group.traverse((one) => (one.renderOrder = 10));
    this.root.add(group);
    this.parts.push(group);
  }

  get isShown() {
    return this.root.visible;
  }

  // Show the gizmo at `place` in the world, turned by `heading` (rad); `null` hides it.
  put(place, heading = 0) {
    this.root.visible = Boolean(place);
    if (!place) return;
    this.root.position.copy(place);
    this.root.quaternion.setFromAxisAngle(up, heading);
  }

  // Return the position of the gizmo's upper end in the world, null while it is hidden.
  get tip() {
    return this.isShown ? this.root.position.clone().addScaledVector(up, TIP * this.root.scale.z) : null;
  }

  // Return the part that `ray`, a Raycaster, hits; null for none.
  hit(ray) {
    if (!this.isShown) return null;
    let [hit] = ray.intersectObjects(this.parts, true);
    let part = hit?.object;
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

function overlayMaterial(color, opacity = 1) {
  const material = new THREE.MeshBasicMaterial({ color, opacity, transparent: true, depthTest: false, side: THREE.DoubleSide });
  material.colorWrite = opacity > 0;
  return material;
}

// A drag by one part of the gizmo. It converts the mouse's rays to the object's place and heading.
export class Drag {
  // `kind` and `axis` are the part's; `place` and `heading` (rad) the object's, and `ray` the mouse's, at the start.
  constructor({ kind, axis }, place, heading, ray, camera) {
    this.kind = kind;
    this.place = place.clone();
    this.heading = heading;
    const rotation = new THREE.Quaternion().setFromAxisAngle(up, heading);
    this.axis = unit(axis).applyQuaternion(rotation);
    this.plane = new THREE.Plane().setFromNormalAndCoplanarPoint(this.normal(camera), this.place);
    this.began = this.meet(ray) ?? this.place.clone();
  }

  // Return the normal of the plane in which the mouse is followed.
  normal(camera) {
    if (this.kind !== "axis") return this.axis;
    const sight = this.place.clone().sub(camera.position).normalize();
    const aside = sight.clone().cross(this.axis); // the plane contains the axis and faces the camera
    return aside.lengthSq() > 1e-6 ? aside.cross(this.axis).normalize() : sight;
  }

  meet(ray) {
    return ray.intersectPlane(this.plane, new THREE.Vector3());
  }

  // Return the object's place and heading for `ray`, null if the ray misses the plane, as above the horizon.
  to(ray) {
    const now = this.meet(ray);
    if (!now) return null;
    const offset = now.clone().sub(this.began);
    if (this.kind === "axis") return { place: this.place.clone().addScaledVector(this.axis, offset.dot(this.axis)), heading: this.heading };
    if (this.kind === "plane") return { place: this.place.clone().add(offset), heading: this.heading };
    const angle = (point) => Math.atan2(point.y - this.place.y, point.x - this.place.x);
    return { place: this.place.clone(), heading: this.heading + angle(now) - angle(this.began) };
  }
}
