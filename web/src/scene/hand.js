// Mouse and key input in the scene in flight mode: camera, selection, pushes and drags. Pushes and drags go to the node.
import * as THREE from "three";
import { Drag } from "./gizmo.js";
import { Pointer } from "./pointer.js";

const STAYS = 500; // ms for which handles stay after the mouse has left
const MESSAGE_PERIOD = 30; // ms between two drag messages to the node
const DOUBLE = 400; // ms, longest time between the clicks of a double click

/**
 * @typedef {{ place: THREE.Vector3, heading: number }} Place
 * @typedef {{ name: string, handle: wire.Marker, drag: Drag, isNew: boolean, now?: Place, saying?: ReturnType<typeof setTimeout> }} Dragged
 */

export class Hand {
  /** @param {import("./scene.js").Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.hovered = null; // name of the object that the mouse is over, or left less than STAYS ago
    /** @type {Dragged | null} */
    this.dragged = null;
    this.clicked = -DOUBLE;
    this.caster = new THREE.Raycaster();
    this.pointer = new Pointer(scene.canvas.dom, this.acts());
    window.addEventListener("keydown", (event) => this.key(event));
  }

  ray(event) {
    const box = this.scene.canvas.dom.getBoundingClientRect();
    const at = new THREE.Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
    this.caster.setFromCamera(at, this.scene.camera);
    return this.caster;
  }

  // Return the name of the object under the mouse and the point where the ray hits it, null for none.
  pick(event) {
    const things = this.scene.things().filter((one) => one.visible && one.parent);
    const [hit] = this.ray(event).intersectObjects(things, true);
    /** @type {THREE.Object3D | null} */
    let object = hit?.object ?? null;
    while (object && !object.userData.said) object = object.parent;
    return object ? { name: object.userData.said.ns, point: hit.point } : null;
  }

  hover(name) {
    if (!name && this.hovered) this.leaving ??= setTimeout(() => this.enter(null), STAYS);
    else this.enter(name);
  }

  enter(name) {
    clearTimeout(this.leaving);
    this.leaving = undefined;
    if (name === this.hovered) return;
    this.hovered = name;
    this.scene.rearrange();
  }

  acts() {
    return {
      take: (event) => this.grab(event),
      drag: (event) => this.drag(event),
      drop: () => this.drop(),
      click: (event) => this.click(event),
      look: (event) => this.lookAt(event),
      hover: (event) => this.over(event),
      orbit: (right, down) => this.moveView(() => this.scene.view.orbit(right, down, this.scene.canvas.element.clientHeight)),
      pan: (right, down) => this.moveView(() => this.scene.view.pan(right, down, this.scene.canvas.element.clientHeight)),
      zoom: (factor) => this.moveView(() => this.scene.view.approachBy(factor)),
    };
  }

  moveView(move) {
    move();
    this.scene.change();
  }

  over(event) {
    if (event?.pointerType === "touch") return;
    this.isOver = event;
    this.looking ??= requestAnimationFrame(() => this.meet());
  }

  // Update hover and cursor for the last mouse event, once per animation frame.
  meet() {
    this.looking = undefined;
    const event = this.isOver;
    if (!event) return this.hover(null);
    const part = this.scene.gizmo.hit(this.ray(event));
    if (this.scene.gizmo.light(part)) this.scene.change();
    const name = part ? this.scene.active : this.pick(event)?.name;
    this.scene.canvas.dom.style.cursor = part ? "grab" : name ? "pointer" : "";
    this.hover(name ?? null);
  }

  click(event) {
    if (event.shiftKey) return;
    const name = this.pick(event)?.name ?? "";
    const isVehicle = this.scene.bodies?.has(name);
    const isFirst = event.timeStamp - this.clicked > DOUBLE;
    this.clicked = event.timeStamp;
    if (isVehicle && isFirst) this.push(name);
    const isNew = name !== this.scene.selected || isVehicle;
    this.scene.select(name && this.scene.handleOf(name) && isNew ? name : "");
  }

  push(name) {
    this.scene.say({ push: name, ray: this.caster.ray.direction.toArray(), newtons: this.scene.pushes });
  }

  lookAt(event) {
    const hit = this.pick(event);
    if (hit) this.scene.frame(hit.name);
  }

  // Start a drag by a handle or by the selected object; return "part" or "thing", null for neither.
  grab(event) {
    const part = this.scene.gizmo.hit(this.ray(event));
    const name = part ? this.scene.active : this.pick(event)?.name;
    const handle = name && this.scene.handleOf(name);
    if (!handle || (!part && name !== this.scene.selected)) return null;
    const place = this.scene.place(name) ?? handle.getWorldPosition(new THREE.Vector3());
    const action = part ? part.userData : { kind: "plane", axis: 2 }; // the selected object slides horizontally
    const drag = new Drag(action, place, headingOf(handle), this.ray(event).ray, this.scene.camera);
    this.dragged = { name, handle: handle.userData.said, drag, isNew: true };
    this.scene.gizmo.light(part);
    return part ? "part" : "thing";
  }

  drag(event) {
    const { dragged } = this;
    if (!dragged) return;
    const now = dragged.drag.to(this.ray(event).ray);
    if (!now) return;
    if (dragged.isNew) this.sayDrag(dragged, "start", { place: dragged.drag.place, heading: dragged.drag.heading });
    if (dragged.isNew) this.scene.view.hold();
    dragged.isNew = false;
    dragged.now = now;
    dragged.saying ??= setTimeout(() => this.sayMove(dragged), MESSAGE_PERIOD);
    this.scene.change();
  }

  sayMove(dragged) {
    clearTimeout(dragged.saying);
    dragged.saying = undefined;
    if (this.dragged === dragged && dragged.now) this.sayDrag(dragged, "move", dragged.now);
  }

  drop() {
    const { dragged } = this;
    if (dragged?.now) {
      if (dragged.saying !== undefined) this.sayMove(dragged);
      this.sayDrag(dragged, "end", dragged.now);
      this.scene.view.letGo();
    }
    this.dragged = null;
    this.scene.gizmo.light(null);
    this.scene.change();
  }

  sayDrag({ handle: { layer, ns } }, phase, { place, heading }) {
    const quaternion = [0, 0, Math.sin(heading / 2), Math.cos(heading / 2)];
    this.scene.say({ drag: phase, server: layer, name: ns, pose: [...place.toArray(), ...quaternion] });
  }

  key(event) {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.("input, textarea, select, [contenteditable], dialog")) return;
    if (event.key === "Escape") this.scene.select("");
    if (event.key === "." || event.key === "Home") this.scene.frame();
  }
}

// Return the direction of an object's x axis in the world, seen from above: rad.
export function headingOf(object) {
  const ahead = new THREE.Vector3().setFromMatrixColumn(object.matrixWorld, 0);
  return Math.atan2(ahead.y, ahead.x);
}
