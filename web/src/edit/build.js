// Edit mode of the page: the Edit panel, and the toolbar and the shelf of models around the scene, like V-REP's window.
import { Menu } from "../menu.js";
import { at, create } from "../dom.js";
import { keep, kept } from "../storage.js";
import { split } from "../split.js";
import { Arrange } from "./arrange.js";
import { askFor } from "./ask.js";
import { Clipboard } from "./clipboard.js";
import { Edit } from "./edit.js";
import { FRAMES_OF_HANDLES } from "./frames.js";
import { Hierarchy } from "./hierarchy.js";
import { listen } from "./keys.js";
import { Models } from "./models.js";
import { PosePanel } from "./pose_panel.js";
import { Properties } from "./properties.js";
import { SceneFiles } from "./scene_files.js";
import { SceneText } from "./scene_text.js";

const ENDS = [["low", -1, "low ends"], ["middle", 0, "middles"], ["high", 1, "high ends"]];

export class Build {
  // `openScript(file)` opens a file in the editor; `showScript(isShown)` shows the side with the editor and the scene's text.
  /**
   * @param {import("../scene/scene.js").Scene} scene
   * @param {wire.Ask} ask
   * @param {import("../notice.js").Notice} notice
   */
  constructor(scene, ask, notice, { openScript, showScript }) {
    this.showScript = showScript;
    const edit = new Edit(scene, ask, notice, (file) => (this.showText(false), showScript(true), openScript(file)));
    this.edit = edit;
    this.arrange = new Arrange(edit);
    this.clipboard = new Clipboard(edit);
    this.files = new SceneFiles(edit);
    this.hierarchy = new Hierarchy(at("tree"), at("tree-find"), edit);
    this.models = new Models(at("models"), at("models-find"), edit);
    new PosePanel(at("pose"), edit);
    this.properties = new Properties(at("properties"), edit, () => this.showText(true));
    const parts = { part: at("scene-text"), text: at("scene-text-editor"), said: at("scene-text-said"), title: at("scene-text-title"), question: at("scene-text-question") };
    this.text = new SceneText(parts, edit);
    at("align").append("Align with the last one", ...["x", "y", "z"].map((axis, number) => this.aligns(axis, number)));
    this.acts = this.actions();
    this.connect();
    split(at("under-tree"), "--tree", "y", 80, () => at("edit-panel").clientHeight - 120, (event) => event.clientY - at("tree").getBoundingClientRect().top);
    for (const what of ["mode", "selection", "objects"]) edit.on(what, () => this.show());
    this.showShelf(kept("edit/shelf", true));
    this.show();
  }

  // ---- called by the page

  turn(on) {
    document.body.classList.toggle("editing", on);
    at("build-bar").hidden = at("shelf").hidden = !on;
    if (on) this.showShelf(kept("edit/shelf", true));
    else this.showText(false);
    this.edit.turn(on);
  }

  /** @param {wire.Told} message */
  told({ tree }) {
    if (tree) this.edit.take(tree);
  }

  // ---- actions of buttons, menus and keys

  actions() {
    const { edit, arrange, files, hierarchy } = this;
    return {
      translate: () => this.mode("translate"), rotate: () => this.mode("rotate"), scale: () => this.mode("scale"),
      frame: () => this.turnFrame(),
      grid: () => this.snap(!edit.handles.isSnapped),
      measure: () => (edit.hand.measuring ? edit.endMeasure() : edit.beginMeasure()),
      floor: () => arrange.dropToFloor(),
      remove: () => arrange.remove(), rename: () => hierarchy.rename(),
      copy: () => this.clipboard.copy(), paste: () => this.clipboard.ask(), duplicate: () => arrange.duplicate(),
      array: () => this.askForArray(),
      undo: () => edit.undo("undo"), redo: () => edit.undo("redo"),
      all: () => edit.select([...edit.objects.all()].filter(({ of, parent }) => of === "scene" && parent < 0).map(({ handle }) => handle)),
      group: () => arrange.group("model"), shape: () => arrange.group("shape"), ungroup: () => arrange.ungroup(),
      python: () => arrange.attachScript("python"), lua: () => arrange.attachScript("lua"), detach: () => arrange.detachScript(),
      new: () => files.begin(), open: () => files.open(), save: () => this.text.write().then(() => files.save()), as: () => files.saveAs(), model: () => files.saveModel(),
      text: () => this.showText(!this.text.isShown),
      shelf: () => this.showShelf(at("shelf").classList.contains("folded")),
      find: () => at("tree-find").focus(),
    };
  }

  connect() {
    for (const button of document.querySelectorAll("[data-edit]")) {
      button.onclick = (event) => {
        if (event.detail) button.blur(); // otherwise Space would press the button again
        this.acts[button.dataset.edit]();
      };
    }
    for (const name of /** @type {const} */ (["scene", "edit"])) new Menu(at(`${name}-menu-open`), at(`${name}-menu`));
    at("handles-frame").append(...Object.entries(FRAMES_OF_HANDLES).map(([value, words]) => new Option(words, value)));
    at("handles-frame").onchange = () => this.setFrame(at("handles-frame").value);
    at("scene-text-close").onclick = () => this.showText(false);
    const isAway = (target) => target.closest?.("#editor") && !this.text.isShown;
    listen(this.acts, (text) => this.clipboard.paste(text), () => this.edit.isOn, isAway);
    window.addEventListener("keydown", (event) => this.escape(event));
    at("edit-panel").addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation(); // Escape would also fold the panel
      this.escape(event);
    });
  }

  escape(event) {
    if (event.key !== "Escape" || event.defaultPrevented || !this.edit.isOn || event.target.closest?.("input, select, textarea, [contenteditable], dialog")) return;
    const { edit } = this;
    if (!edit.hand.cancel()) edit.hand.measuring ? edit.endMeasure() : edit.select([]);
  }

  mode(mode) {
    this.edit.handles.mode = mode;
    this.edit.scene.change();
    this.show();
  }

  turnFrame() {
    const frames = Object.keys(FRAMES_OF_HANDLES);
    this.setFrame(frames[(frames.indexOf(this.edit.frame) + 1) % frames.length]);
  }

  setFrame(frame) {
    this.edit.frame = at("handles-frame").value = frame;
    this.edit.scene.change();
  }

  snap(on) {
    this.edit.handles.isSnapped = on;
    this.show();
  }

  askForArray() {
    const step = this.arrange.aside();
    const count = (axis, value) => ({ label: `How many along ${axis}`, value, type: "number", low: 1, high: 100, step: 1 });
    const apart = (axis, value) => ({ label: `How far apart, m`, value, type: "number" });
    const fields = [count("x", 3), apart("x", step), count("y", 1), apart("y", step), count("z", 1), apart("z", step)];
    const act = ([nx, dx, ny, dy, nz, dz]) => this.arrange.duplicate([nx, ny, nz], [dx, dy, dz]);
    askFor("Duplicate in a row, or a grid", fields, "Duplicate", act);
  }

  aligns(axis, number) {
    const buttons = ENDS.map(([word, end, words]) => {
      const attributes = { type: "button", textContent: word, title: `The ${words} along ${axis}`, "aria-label": `Align the ${words} along ${axis}` };
      return create("button", { ...attributes, onclick: () => this.arrange.align(number, end) });
    });
    return create("span", { role: "group", "aria-label": `Along ${axis}` }, axis, ...buttons);
  }

  // ---- display

  showText(on) {
    if (on === this.text.isShown) return;
    this.text.show(on);
    if (on) this.showScript(true);
    for (const one of document.querySelectorAll("[data-edit=text]")) one.setAttribute("aria-pressed", String(on));
  }

  showShelf(on) {
    at("shelf").classList.toggle("folded", !on);
    document.body.classList.toggle("with-shelf", on);
    keep("edit/shelf", on);
    document.querySelector("button[data-edit=shelf]")?.setAttribute("aria-pressed", String(on));
  }

  show() {
    const { edit } = this;
    const { undo, redo, state } = edit.is;
    const one = edit.objects.get(edit.last);
    const inBar = (name) => /** @type {HTMLButtonElement} */ (document.querySelector(`#build-bar [data-edit=${name}]`));
    const press = (name, on) => inBar(name).setAttribute("aria-pressed", String(on));
    for (const mode of ["translate", "rotate", "scale"]) press(mode, edit.handles.mode === mode);
    press("grid", edit.handles.isSnapped);
    press("measure", Boolean(edit.hand.measuring));
    for (const [name, what] of [["undo", undo], ["redo", redo]]) {
      const button = inBar(name);
      button.disabled = !what;
      button.title = `${name === "undo" ? "Undo" : "Redo"}${what ? `: ${what}` : ""} (Ctrl+${name === "undo" ? "Z" : "Y"})`;
    }
    const whyNoModel = this.files.whyNoModel();
    const saveModel = /** @type {HTMLButtonElement} */ (document.querySelector("#scene-menu [data-edit=model]"));
    saveModel.disabled = Boolean(whyNoModel);
    saveModel.title = whyNoModel || "The selected object with all its children becomes a model on the shelf";
    at("until-stop").hidden = !state || state === "stopped";
    const count = edit.selected.length;
    at("selected").textContent = !one ? "Nothing is selected" : count > 1 ? `${count} objects; the last: ${one.name}` : one.name;
    at("selected-type").textContent = one && count === 1 ? one.type.replaceAll("_", " ") : "";
    at("pose").hidden = !one || one.of === "floor";
    at("nothing").hidden = Boolean(one);
    at("align").hidden = count < 2;
    at("attached").hidden = count !== 1 || !(one?.of === "scene" || one?.root);
    at("attached-none").hidden = Boolean(one?.script);
    at("detach").hidden = Boolean(one?.root); // a vehicle always has a script
    at("attached-one").hidden = !one?.script;
    at("attached-open").onclick = () => one && edit.openScript(one);
    at("attached-open").textContent = `Open ${one?.script?.split("/").pop() ?? ""}`;
  }
}
