// Editing of the scene: what is selected, what is done to it, and who is told of that. The node has the scene; here is
// what it tells of it.
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

const TARGET = "target"; // the alias of the green sphere: what of a vehicle is moved by itself
const AWAY = 60; // m from the middle of the floor, of an eye that sees nothing of the scene
/** @type {wire.EditorState} */
const NOTHING = { file: "", new: false, modified: false, read_only: false, state: "", undo: "", redo: "", draft: null, revision: 0 };

export class Edit {
  // `ask` asks the node, `notice` is the message line, `openScript(file)` opens one in the editor.
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
    this.is = NOTHING; // of the scene as a whole
    /** @type {number[]} */
    this.selected = []; // handles, the last one last
    this.expected = new Set(); // selected, but not told yet
    this.hearing = new Map();
    this.isOn = false;
    this.frame = "world"; // the axes of the handles
    this.isAway = false; // the handles go when a flight starts, until something is selected
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

  // ---- begin and end

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
    this.missed = undefined; // once, however much is missed meanwhile
    // What has been told meanwhile may be newer.
    const take = ({ tree }) => tree.version >= (this.objects.version ?? tree.version) && this.take(tree);
    const end = () => {
      this.asking = false;
      if (this.missed !== undefined && this.missed > (this.objects.version ?? -1)) this.connected(); // the answer was on its way before
    };
    return this.ask("tree").then(take, (error) => this.wrong(error.message)).finally(end);
  }

  lost() {
    this.objects.clear();
    this.assumed.clear();
    this.is = NOTHING;
    this.selected = [];
    for (const what of ["tree", "objects", "selection"]) this.emit(what);
    this.show();
  }

  // ---- what the node tells

  /** @param {wire.TreeChange} told */
  take(told) {
    if (!this.isOn) return void (this.objects.version = null);
    const changed = this.objects.take(told);
    if (changed === "missed") {
      this.missed = told.version;
      return void this.connected();
    }
    const { objects, gone, version, since, ...is } = told;
    const isFlying = is.state !== "stopped";
    const hasEnded = !isFlying && this.is.state !== is.state;
    this.isAway = isFlying && (this.isAway || this.is.state === "stopped");
    this.is = is;
    this.assumed.tell(is.revision);
    for (const one of [...this.expected]) if (this.objects.get(one)) this.expected.delete(one);
    const still = this.selected.filter((one) => this.objects.get(one) || this.expected.has(one));
    if (changed === "tree") this.emit("tree");
    this.emit("objects");
    if (still.length !== this.selected.length || changed === "tree") this.choose(still);
    this.show();
    if (hasEnded) this.comeBack();
  }

  // Paints anew what is seen of the objects, and of what is selected.
  show() {
    this.glyphs.show(this.isOn ? this.seen.bodiless() : null);
    this.scene.rearrange();
  }

  // ---- what is selected

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

  // What a click on an object selects: its outermost model first, what it is a part of next, then the part itself.
  shownAs(handle) {
    const models = this.objects.above(handle).filter((one) => this.objects.existing(one).model || this.objects.existing(one).root);
    const way = [...models.reverse(), handle];
    const at = way.findLastIndex((one) => this.has(one));
    return way[Math.min(at + 1, way.length - 1)];
  }

  // ---- the handles: the scene asks while one edits

  // The object that has them, undefined for none.
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

  // A drone that flew away has taken the view with it, so that nothing of the scene could be seen.
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

  // ---- frames and places

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

  // ---- what is done

  // Does some operations as one edit; returns the answer, undefined where it was refused. It is asked for at once: the
  // node does in turn what a page asks, so a start, a save or an undo that is asked for later comes after it.
  /**
   * @param {wire.Operation[]} operations
   * @param {string} name
   * @param {string} [merge]
   */
  async do(operations, name, merge) {
    try {
      const { is } = this;
      const answer = await this.assumed.during(this.ask("edit", { edit: operations, name, ...(merge ? { merge } : {}) }));
      this.emit("objects"); // what was told meanwhile counts now
      const first = answer.until_stop && !this.hasTold;
      if (first) this.notice.say("The simulation runs: stop will undo your edits. To keep them, stop first.");
      this.hasTold = Boolean(answer.until_stop) && is.state !== "stopped";
      return answer;
    } catch (error) {
      this.wrong(error.message);
      this.connected(); // what was assumed is not so
    }
  }

  // Does what makes objects, and selects the first of them, or all.
  /** @param {wire.Operation[]} operations */
  async make(operations, name, isAll = false) {
    const answer = await this.do(operations, name);
    const made = answer?.handles ?? [];
    const chosen = isAll ? made : made.slice(0, 1);
    for (const one of chosen) if (!this.objects.get(one)) this.expected.add(one);
    if (chosen.length) this.select(chosen);
    return answer;
  }

  wrong(line) {
    this.notice.say(line, true);
  }

  /**
   * @param {"undo" | "redo"} which
   * @param {string} [merge] of one drag, whatever others have done since
   */
  async undo(which, merge) {
    try {
      const { said, handles = [] } = await this.ask(which, merge ? { merge } : {});
      this.notice.say(said);
      const there = handles.filter((one) => this.objects.get(one));
      if (there.length) this.select(there);
    } catch (error) {
      this.wrong(error.message);
    }
  }

  // Puts objects at places: matrices of the world, by handle.
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

  // Selects the object that has the name already.
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
