// What the mouse does to the scene: it looks about, chooses, pushes and drags; the node is told.
import * as THREE from "three";
import { Drag } from "./gizmo.js";
import { Pointer } from "./pointer.js";

const STAYS = 500; // ms, that handles stay after the mouse has gone
const SAID = 30; // ms between two words on where something is dragged
const DOUBLE = 400; // ms between two clicks that are one double click

/**
 * @typedef {{ place: THREE.Vector3, heading: number }} Place
 * @typedef {{ name: string, handle: wire.Marker, drag: Drag, isNew: boolean, now?: Place, saying?: ReturnType<typeof setTimeout> }} Dragged
 */

export class Hand {
  /** @param {import("./scene.js").Scene} scene */
  constructor(scene) {
    this.scene = scene;
    this.hovered = null; // the name of what is under the mouse, or was a moment ago
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

  // Returns the name of what is under the mouse, and the point where it is met.
  pick(event) {
    const here = this.scene.things().filter((one) => one.visible && one.parent);
    const [met] = this.ray(event).intersectObjects(here, true);
    /** @type {THREE.Object3D | null} */
    let object = met?.object ?? null;
    while (object && !object.userData.said) object = object.parent;
    return object ? { name: object.userData.said.ns, point: met.point } : null;
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

  // Looks once for a picture what is under the mouse.
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
    const met = this.pick(event);
    if (met) this.scene.frame(met.name);
  }

  // Takes a part of the handles, or what is selected itself; returns which of both, null for nothing.
  grab(event) {
    const part = this.scene.gizmo.hit(this.ray(event));
    const name = part ? this.scene.active : this.pick(event)?.name;
    const handle = name && this.scene.handleOf(name);
    if (!handle || (!part && name !== this.scene.selected)) return null;
    const place = this.scene.place(name) ?? handle.getWorldPosition(new THREE.Vector3());
    const does = part ? part.userData : { kind: "plane", axis: 2 }; // what is selected slides level
    const drag = new Drag(does, place, headingOf(handle), this.ray(event).ray, this.scene.camera);
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
    dragged.saying ??= setTimeout(() => this.sayMove(dragged), SAID);
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
    const turn = [0, 0, Math.sin(heading / 2), Math.cos(heading / 2)];
    this.scene.say({ drag: phase, server: layer, name: ns, pose: [...place.toArray(), ...turn] });
  }

  key(event) {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.target.closest?.("input, textarea, select, [contenteditable], dialog")) return;
    if (event.key === "Escape") this.scene.select("");
    if (event.key === "." || event.key === "Home") this.scene.frame();
  }
}

// Where a frame, or what hangs on it, points to, seen from above: rad.
export function headingOf(object) {
  const ahead = new THREE.Vector3().setFromMatrixColumn(object.matrixWorld, 0);
  return Math.atan2(ahead.y, ahead.x);
}
