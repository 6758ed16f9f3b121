// What the mouse does to the scene while one builds: it selects, drags by handles or as a thing on a level, and measures.
import * as THREE from "three";
import { onGrid } from "./handles.js";

const up = new THREE.Vector3(0, 0, 1);

export const isFree = (event) => event.ctrlKey || event.metaKey;

// Beside the flight's hand, whose looking about stays.
export class EditHand {
  /**
   * @param {import("../scene/scene.js").Scene} scene
   * @param {import("./edit.js").Edit} edit
   * @param {import("./handles.js").Handles} handles
   */
  constructor(scene, edit, handles) {
    this.scene = scene;
    this.edit = edit;
    this.handles = handles;
    this.caster = new THREE.Raycaster();
    this.began = this.from = new THREE.Vector3(); // of a slide: what was met, and where the thing was
    this.level = new THREE.Plane(); // on which it slides
    this.measuring = null; // takes points while one measures
  }

  // What of the pointer's acts is another while one builds.
  get acts() {
    return {
      take: (event) => this.take(event),
      drag: (event) => this.drag(event),
      drop: () => this.drop(),
      click: (event) => this.click(event),
      hover: (event) => this.hover(event),
      look: () => this.edit.last !== undefined && this.scene.frame(),
    };
  }

  place(event) {
    const box = this.scene.canvas.dom.getBoundingClientRect();
    return new THREE.Vector2((2 * (event.clientX - box.left)) / box.width - 1, 1 - (2 * (event.clientY - box.top)) / box.height);
  }

  ray(event) {
    this.caster.setFromCamera(this.place(event), this.scene.camera);
    return this.caster;
  }

  // What is under the mouse: { object, point, normal }, the floor's plane where there is nothing; null in the sky.
  meet(event, without = new Set()) {
    const ray = this.ray(event);
    const things = [...this.scene.things(), ...this.edit.glyphs.all].filter((one) => one.visible && one.parent);
    for (const met of ray.intersectObjects(things, true)) {
      /** @type {THREE.Object3D | null} */
      let object = met.object;
      while (object && !object.userData.said) object = object.parent;
      const found = object && this.edit.seen.objectOf(object.userData.said);
      if (found && without.has(found.handle)) continue;
      const normal = met.face ? met.face.normal.clone().transformDirection(met.object.matrixWorld) : up.clone();
      if (normal.dot(ray.ray.direction) > 0) normal.negate();
      return { object: found, point: met.point, normal };
    }
    const point = ray.ray.intersectPlane(new THREE.Plane(up, 0), new THREE.Vector3());
    return point && { object: undefined, point, normal: up.clone() };
  }

  hover(event) {
    if (event?.pointerType === "touch") return;
    this.over = event;
    this.looking ??= requestAnimationFrame(() => this.look());
  }

  look() {
    this.looking = undefined;
    const event = this.over;
    if (!event || this.dragging) return;
    const before = this.handles.controls.axis;
    const isHandle = !this.measuring && this.handles.hover(this.place(event));
    if (this.handles.controls.axis !== before) this.scene.change();
    const met = isHandle ? null : this.meet(event);
    this.measuring?.over(met?.point);
    this.scene.canvas.dom.style.cursor = this.measuring ? "crosshair" : isHandle ? "grab" : met?.object ? "pointer" : "";
    this.edit.hover(met?.object?.handle);
  }

  click(event) {
    const met = this.meet(event);
    if (this.measuring) return void (met && this.measuring.take(met.point));
    const handle = met?.object && this.edit.shownAs(met.object.handle);
    if (handle === undefined) return event.shiftKey || this.edit.select([]);
    if (event.shiftKey || event.ctrlKey || event.metaKey) this.edit.toggle(handle);
    else this.edit.select([handle]);
  }

  // Takes a handle, or what is selected itself, which slides on its level.
  take(event) {
    if (this.measuring) return null;
    if (this.handles.take(this.place(event), isFree(event))) {
      this.dragging = "handle";
      this.edit.beginDrag();
      return "part";
    }
    const met = this.meet(event);
    const handle = met?.object && [met.object.handle, ...this.edit.objects.above(met.object.handle)].find((one) => this.edit.has(one));
    if (!met || handle === undefined || !this.edit.mayMove(handle)) return null;
    this.dragging = "thing";
    this.began = met.point.clone();
    this.from = new THREE.Vector3().setFromMatrixPosition(this.edit.objects.existing(handle).matrix);
    this.level = new THREE.Plane(up, -met.point.z);
    this.edit.beginDrag();
    return "thing";
  }

  drag(event) {
    if (!this.dragging) return; // Escape has ended it
    if (this.dragging === "handle") this.handles.drag(this.place(event), isFree(event));
    else this.slide(event);
    this.scene.change();
  }

  slide(event) {
    const now = this.ray(event).ray.intersectPlane(this.level, new THREE.Vector3());
    if (!now) return;
    const to = this.from.clone().add(now).sub(this.began);
    if (this.handles.isSnapped !== isFree(event)) to.set(onGrid(to.x), onGrid(to.y), to.z);
    this.slid = new THREE.Matrix4().setPosition(to.sub(this.from));
    this.edit.drag({ matrix: this.slid, factors: null });
  }

  drop() {
    if (this.dragging === "handle") this.edit.endDrag(this.handles.drop());
    else if (this.dragging && this.slid) this.edit.endDrag({ matrix: this.slid, factors: null });
    else if (this.dragging) this.edit.cancelDrag();
    this.dragging = this.slid = undefined;
    this.scene.change();
  }

  // Lets go, and all is where it was; tells whether anything was dragged.
  cancel() {
    if (!this.dragging) return false;
    if (this.dragging === "handle") this.handles.cancel();
    this.dragging = this.slid = undefined;
    this.edit.cancelDrag();
    this.scene.change();
    return true;
  }
}
