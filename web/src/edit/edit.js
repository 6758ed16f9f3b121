// Editing of the scene: selection, requests for changes, and events for the panels. The node owns the scene; `objects` is a
// copy of what it has sent.
import * as THREE from "three";
import { FREE } from "../scene/view.js";
import { Assumed } from "./assumed.js";
import { Drag } from "./drag.js";
import { EditHand } from "./edit_hand.js";
import { Glyphs } from "./glyphs.js";
import { Handles } from "./handles.js";
import { Measure } from "./measure.js";
import { Objects, WORLD } from "./objects.js";
import { poseOf } from "./poses.js";
import { Seen } from "./seen.js";

const TARGET = "target"; // alias of the green sphere, the only part of a vehicle that can be moved alone
const AWAY = 60; // m from the middle of the floor: a camera farther away sees nothing of the scene
/** @type {wire.EditorState} */
const NOTHING = { file: "", new: false, modified: false, read_only: false, state: "", undo: "", redo: "", draft: null, revision: 0 };

export class Edit {
  // `ask` sends a request to the node, `notice` is the message line, `openScript(file)` opens a file in the editor.
  /**
   * @param {import("../scene/scene.js").Scene} scene
   * @param {wire.Ask} ask
   * @param {import("../notice.js").Notice} notice
   * @param {(file: string) => void} openScript
   */
  constructor(scene, ask, notice, openScript) {
    this.scene = scene;
    this.ask = ask;
    this.notice = notice;
    this.openScriptFile = openScript;
    this.objects = new Objects();
    this.assumed = new Assumed(this.objects);
    this.is = NOTHING; // state of the scene as a whole
    /** @type {number[]} */
    this.selected = []; // handles, in the order of selection
    this.expected = new Set(); // handles of new objects that are selected, but not sent by the node yet
    this.hearing = new Map(); // callbacks, by event
    this.isOn = false;
    this.frame = "world"; // the frame whose axes the handles have
    this.isAway = false; // the handles are hidden from the start of a flight until something is selected
    this.glyphs = new Glyphs(scene.world);
    this.handles = new Handles(scene.camera, { changed: (change) => this.drag(change) });
    this.seen = new Seen(this);
    this.measure = new Measure(scene);
    this.hand = new EditHand(scene, this, this.handles);
  }

  on(what, act) {
    this.hearing.set(what, [...(this.hearing.get(what) ?? []), act]);
  }

  emit(what) {
    for (const act of this.hearing.get(what) ?? []) act();
  }

  // ---- begin and end of editing

  turn(on) {
    if (on === this.isOn) return;
    this.isOn = on;
    const { scene } = this;
    scene.select("");
    scene.hand.enter(null);
    scene.editing = on ? this : null;
    scene.hand.pointer.acts = on ? { ...scene.hand.acts(), ...this.hand.acts } : scene.hand.acts();
    if (on) {
      this.viewBefore = scene.view.name;
      if (scene.view.name !== FREE) {
        scene.look(FREE);
        scene.view.stepBack();
      }
      this.connected()?.then(() => this.comeBack());
    } else {
      this.endMeasure();
      if (this.viewBefore !== FREE && scene.view.name === FREE) scene.look(this.viewBefore);
    }
    this.show();
    this.emit("mode");
  }

  connected() {
    if (!this.isOn || this.asking) return;
    this.asking = true;
    this.missed = undefined; // one request at a time, however many changes are missed during it
    // Changes that arrived during the request may be newer than the answer.
    const take = ({ tree }) => tree.version >= (this.objects.version ?? tree.version) && this.take(tree);
    const finish = () => {
      this.asking = false;
      if (this.missed !== undefined && this.missed > (this.objects.version ?? -1)) this.connected(); // the answer is older
    };
    return this.ask("tree").then(take, (error) => this.wrong(error.message)).finally(finish);
  }

  lost() {
    this.objects.clear();
    this.assumed.clear();
    this.is = NOTHING;
    this.selected = [];
    for (const what of ["tree", "objects", "selection"]) this.emit(what);
    this.show();
  }

  // ---- messages of the node

  /** @param {wire.TreeChange} change */
  take(change) {
    if (!this.isOn) return void (this.objects.version = null);
    const changed = this.objects.take(change);
    if (changed === "missed") {
      this.missed = change.version;
      return void this.connected();
    }
    const { objects, gone, version, since, ...is } = change;
    const isFlying = is.state !== "stopped";
    const hasEnded = !isFlying && this.is.state !== is.state;
    this.isAway = isFlying && (this.isAway || this.is.state === "stopped");
    this.is = is;
    this.assumed.tell(is.revision);
    for (const one of [...this.expected]) if (this.objects.get(one)) this.expected.delete(one);
    const kept = this.selected.filter((one) => this.objects.get(one) || this.expected.has(one));
    if (changed === "tree") this.emit("tree");
    this.emit("objects");
    if (kept.length !== this.selected.length || changed === "tree") this.choose(kept);
    this.show();
    if (hasEnded) this.comeBack();
  }

  // Update the glyphs, and the visibility and outlines of objects.
  show() {
    this.glyphs.show(this.isOn ? this.seen.bodiless() : null);
    this.scene.rearrange();
  }

  // ---- selection

  get last() {
    return this.selected.at(-1);
  }

  has(handle) {
    return this.selected.includes(handle);
  }

  select(handles, more = false) {
    this.isAway = false;
    const known = handles.filter((one) => this.objects.get(one) || this.expected.has(one));
    this.choose(more ? [...this.selected.filter((one) => !known.includes(one)), ...known] : known);
  }

  toggle(handle) {
    this.isAway = false;
    this.choose(this.has(handle) ? this.selected.filter((one) => one !== handle) : [...this.selected, handle]);
  }

  choose(handles) {
    this.selected = handles;
    this.emit("selection");
    this.show();
  }

  hover(handle) {
    if (handle === this.hovered) return;
    this.hovered = handle;
    this.scene.rearrange();
  }

  // Return what a click on an object selects: its outermost model first, then the next inner one, at last the object.
  shownAs(handle) {
    const models = this.objects.above(handle).filter((one) => this.objects.existing(one).model || this.objects.existing(one).root);
    const path = [...models.reverse(), handle];
    const at = path.findLastIndex((one) => this.has(one));
    return path[Math.min(at + 1, path.length - 1)];
  }

  // ---- handles; the scene calls these while editing

  // The object that has the handles, undefined for none.
  get held() {
    const one = this.objects.get(this.last);
    const isShown = this.isOn && !this.isAway && !this.hand.measuring && this.scene.shown.handles;
    return isShown && one && this.mayMove(one.handle) ? one : undefined;
  }

  putHandles() {
    const { held } = this;
    const frame = this.handles.mode === "scale" ? "own" : this.frame;
    this.handles.put(held ? this.frameOf(held.handle, frame) : null, held && new THREE.Vector3().setFromMatrixPosition(held.matrix));
  }

  // Show the floor if the camera is too far away to see the scene, as after it has followed a drone that flew away.
  comeBack() {
    const size = this.objects.named("Floor")?.values.size;
    if (size && this.scene.camera.position.length() > Math.max(AWAY, 2 * size)) this.frameFloor();
  }

  frameFloor() {
    const size = this.objects.named("Floor")?.values.size ?? 0;
    this.scene.view.lookAt(new THREE.Vector3(), size / 2);
    this.scene.view.stepBack();
    this.scene.change();
  }

  // ---- frames and permissions

  mayMove(handle) {
    const one = this.objects.get(handle);
    return one !== undefined && (one.of === "scene" || Boolean(one.root) || (one.of === "vehicle" && one.alias === TARGET));
  }

  mayRename({ of }) {
    return of !== "floor";
  }

  frameOf(handle, which) {
    const one = this.objects.get(handle);
    if (which === "own" && one) return one.matrix;
    return (which === "parent" && this.objects.get(one?.parent)?.matrix) || new THREE.Matrix4();
  }

  // ---- changes

  // Do operations as one edit; return the answer, undefined if the node refused it. The request is sent at once: the node
  // handles a page's requests in order, so that a later start, save or undo comes after the edit.
  /**
   * @param {wire.Operation[]} operations
   * @param {string} name
   * @param {string} [merge]
   */
  async do(operations, name, merge) {
    try {
      const { is } = this;
      const answer = await this.assumed.during(this.ask("edit", { edit: operations, name, ...(merge ? { merge } : {}) }));
      this.emit("objects"); // show what the node sent during the request
      const isFirst = answer.until_stop && !this.hasTold;
      if (isFirst) this.notice.say("The simulation runs: stop will undo your edits. To keep them, stop first.");
      this.hasTold = Boolean(answer.until_stop) && is.state !== "stopped";
      return answer;
    } catch (error) {
      this.wrong(error.message);
      this.connected(); // replaces the values that were assumed
    }
  }

  // Do operations that create objects, and select the first new object, or all.
  /** @param {wire.Operation[]} operations */
  async make(operations, name, isAll = false) {
    const answer = await this.do(operations, name);
    const created = answer?.handles ?? [];
    const chosen = isAll ? created : created.slice(0, 1);
    for (const one of chosen) if (!this.objects.get(one)) this.expected.add(one);
    if (chosen.length) this.select(chosen);
    return answer;
  }

  wrong(line) {
    this.notice.say(line, true);
  }

  /**
   * @param {"undo" | "redo"} which
   * @param {string} [merge] the key of a drag: undo this drag, even if other edits came after it
   */
  async undo(which, merge) {
    try {
      const { said, handles = [] } = await this.ask(which, merge ? { merge } : {});
      this.notice.say(said);
      const existing = handles.filter((one) => this.objects.get(one));
      if (existing.length) this.select(existing);
    } catch (error) {
      this.wrong(error.message);
    }
  }

  // Move objects; `places` has their matrices in the world, by handle.
  place(places, name = this.named("Move", [...places.keys()]), merge) {
    for (const [handle, matrix] of places) this.assumed.put(handle, matrix);
    this.glyphs.show(this.seen.bodiless());
    /** @type {wire.Move[]} */
    const operations = [...places].map(([object, matrix]) => {
      const [x, y, z, ...quaternion] = poseOf(matrix);
      return { do: "move", object, position: [x, y, z], quaternion, relative_to: "world" };
    });
    return this.do(operations, name, merge);
  }

  named(verb, handles = this.selected) {
    return `${verb} ${handles.length === 1 ? this.objects.get(handles[0])?.name ?? "" : `${handles.length} objects`}`;
  }

  // Rename an object. If another one has the name already, select that one.
  async rename({ handle, name: before }, name) {
    const answer = await this.do([{ do: "rename", object: handle, name }], `Rename ${before}`);
    const other = this.objects.named(name);
    if (!answer && other && other.handle !== handle) this.select([other.handle]);
    return answer;
  }

  hang(parent, isRelative) {
    const objects = this.objects.roots(this.selected);
    const under = parent === WORLD ? "the world" : this.objects.existing(parent).name;
    return this.do([{ do: "reparent", objects, parent, keep: isRelative ? "relative" : "pose" }], `${this.named("Hang", objects)} on ${under}`);
  }

  set(handles, values, merge) {
    for (const one of handles) this.assumed.set(one, values);
    return this.do(handles.map((object) => ({ do: "set", object, values })), this.named("Change", handles), merge);
  }

  openScript({ script }) {
    return this.openScriptFile(script);
  }

  // ---- drags

  beginDrag() {
    const roots = this.objects.roots(this.selected).filter((one) => this.mayMove(one));
    this.dragged = new Drag(this, roots);
  }

  drag(change) {
    this.dragged?.go(change);
  }

  endDrag(change) {
    this.dragged?.end(change);
    this.dragged = null;
  }

  cancelDrag() {
    this.dragged?.cancel();
    this.dragged = null;
  }

  // ---- measure

  beginMeasure() {
    this.hand.measuring = this.measure;
    this.emit("mode");
    this.scene.rearrange();
  }

  endMeasure() {
    this.hand.measuring = null;
    this.measure.clear();
    this.emit("mode");
    this.scene.rearrange();
  }
}
