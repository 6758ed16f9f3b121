// Mouse input in the scene in edit mode: select, drag by handles or along a horizontal plane, measure.
import * as THREE from "three";
import { onGrid } from "./handles.js";

const up = new THREE.Vector3(0, 0, 1);

export const isFree = (event) => event.ctrlKey || event.metaKey; // the key that switches the grid off or on during a drag

// Replaces some callbacks of hand.js; the camera's remain.
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
    this.began = this.from = new THREE.Vector3(); // of a slide: the point under the mouse, and the object's position
    this.level = new THREE.Plane(); // the horizontal plane of a slide
    this.measuring = null; // the Measure that gets the points, while measuring
  }

  // The pointer's callbacks that differ from hand.js.
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

  // Return { object, point, normal } under the mouse, for the floor's plane if no object is there; null in the sky.
  meet(event, without = new Set()) {
    const ray = this.ray(event);
    const things = [...this.scene.things(), ...this.edit.glyphs.all].filter((one) => one.visible && one.parent);
    for (const hit of ray.intersectObjects(things, true)) {
      /** @type {THREE.Object3D | null} */
      let object = hit.object;
      while (object && !object.userData.said) object = object.parent;
      const target = object && this.edit.seen.objectOf(object.userData.said);
      if (target && without.has(target.handle)) continue;
      const normal = hit.face ? hit.face.normal.clone().transformDirection(hit.object.matrixWorld) : up.clone();
      if (normal.dot(ray.ray.direction) > 0) normal.negate();
      return { object: target, point: hit.point, normal };
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
    const hit = isHandle ? null : this.meet(event);
    this.measuring?.over(hit?.point);
    this.scene.canvas.dom.style.cursor = this.measuring ? "crosshair" : isHandle ? "grab" : hit?.object ? "pointer" : "";
    this.edit.hover(hit?.object?.handle);
  }

  click(event) {
    const hit = this.meet(event);
    if (this.measuring) return void (hit && this.measuring.take(hit.point));
    const handle = hit?.object && this.edit.shownAs(hit.object.handle);
    if (handle === undefined) return event.shiftKey || this.edit.select([]);
    if (event.shiftKey || event.ctrlKey || event.metaKey) this.edit.toggle(handle);
    else this.edit.select([handle]);
  }

  // Start a drag by a handle, or a slide of the selected object in a horizontal plane; return "part", "thing", or null for none.
  take(event) {
    if (this.measuring) return null;
    if (this.handles.take(this.place(event), isFree(event))) {
      this.dragging = "handle";
      this.edit.beginDrag();
      return "part";
    }
    const hit = this.meet(event);
    const handle = hit?.object && [hit.object.handle, ...this.edit.objects.above(hit.object.handle)].find((one) => this.edit.has(one));
    if (!hit || handle === undefined || !this.edit.mayMove(handle)) return null;
    this.dragging = "thing";
    this.began = hit.point.clone();
    this.from = new THREE.Vector3().setFromMatrixPosition(this.edit.objects.existing(handle).matrix);
    this.level = new THREE.Plane(up, -hit.point.z);
    this.edit.beginDrag();
    return "thing";
  }

  drag(event) {
    if (!this.dragging) return; // Escape has cancelled the drag
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

  // Cancel the drag and move its objects back; return whether there was one.
  cancel() {
    if (!this.dragging) return false;
    if (this.dragging === "handle") this.handles.cancel();
    this.dragging = this.slid = undefined;
    this.edit.cancelDrag();
    this.scene.change();
    return true;
  }
}
