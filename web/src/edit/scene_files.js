// Scene files: new, open, save, save as, save a model; and the draft of an earlier session.
import { at, create } from "../dom.js";
import { askFor } from "./ask.js";

const nameOf = (path) => path.split("/").pop();
const stem = (path) => nameOf(path).replace(/\.\w+$/, "");
const KINDS = { own: "Yours", recent: "Opened last", package: "Of the package" };

export class SceneFiles {
  /** @param {import("./edit.js").Edit} edit */
  constructor(edit) {
    this.edit = edit;
    edit.on("objects", () => {
      this.show();
      this.frame();
    });
  }

  // Show the file's name, whether changes are not saved, and a question if an earlier session has left a draft.
  show() {
    const { file, modified, draft, new: isNew } = this.edit.is;
    at("scene-file").textContent = file ? nameOf(file) : isNew ? "new scene" : "as launched";
    at("scene-file").title = file;
    at("scene-menu-open").ariaLabel = `Scene file: ${at("scene-file").textContent}`;
    at("scene-modified").hidden = !modified;
    const question = at("draft");
    question.hidden = !draft;
    if (!draft || question.dataset.of === String(draft.saved)) return;
    question.dataset.of = String(draft.saved);
    const when = new Date(1000 * draft.saved).toLocaleString();
    const choice = (which, textContent) => create("button", { type: "button", textContent, onclick: () => this.act("draft", { draft: which }) });
    question.replaceChildren(`${draft.file ? nameOf(draft.file) : "A new scene"} was not saved (${when}). `, choice("take", "Go on with it"), choice("drop", "Forget it"));
  }

  async act(ask, more) {
    try {
      const answer = await this.edit.ask(ask, more);
      if (answer.said) this.edit.notice.say(answer.said);
      return answer;
    } catch (error) {
      this.edit.wrong(error.message);
      return null;
    }
  }

  // Call `act`; if changes are not saved, ask first.
  ifSaved(act) {
    const { modified, file } = this.edit.is;
    if (!modified) return act();
    askFor(`${file ? nameOf(file) : "The new scene"} has changes that are not saved`, [], "Throw them away", act);
  }

  begin() {
    return this.ifSaved(async () => {
      this.begun = (await this.act("new_scene"))?.revision;
      this.frame();
    });
  }

  // Show the floor of a new scene once its tree is here. Earlier trees may arrive after the request, this one before the answer.
  frame() {
    if (!(this.begun <= this.edit.is.revision)) return;
    this.begun = undefined;
    this.edit.frameFloor();
  }

  save() {
    return this.edit.is.file && !this.edit.is.read_only ? this.act("save_scene") : this.saveAs();
  }

  saveAs() {
    const { file } = this.edit.is;
    const field = { label: "Name", value: file ? nameOf(file).replace(/\.tt[tm]$/, ".yaml") : "my_scene.yaml" };
    this.askForFile("Save the scene as", field, "save_scene", {});
  }

  // Return why the selection cannot be saved as a model; "" if it can.
  whyNoModel() {
    const one = this.edit.objects.get(this.edit.last);
    if (!one) return "Nothing is selected: a model is an object with all its children";
    if (this.edit.selected.length > 1) return "Several objects are selected: group them to a model first";
    if (one.of === "floor") return "The floor cannot be saved as a model";
    if (one.of === "vehicle") return `${one.name} is a vehicle or a part of one, which cannot be saved as a model`;
    if (one.type === "script") return "A script is saved with its object: select that one";
    return "";
  }

  saveModel() {
    const one = this.edit.objects.existing(this.edit.last);
    if (this.whyNoModel()) return this.edit.wrong(this.whyNoModel());
    this.askForFile(`Save ${one.name} as a model`, { label: "Name", value: `${one.name}.yaml` }, "save_model", { object: one.handle });
  }

  // Ask for a file name and save. If the file exists, a second Save with the same name replaces it.
  askForFile(title, field, ask, more) {
    let taken = "";
    askFor(title, [field], "Save", async ([name]) => {
      const file = /\.ya?ml$/.test(name) ? name : `${name}.yaml`;
      try {
        const { said } = await this.edit.ask(ask, { ...more, file, ...(taken === file ? { over: true } : {}) });
        this.edit.notice.say(said ?? `saved ${file}`);
      } catch (error) {
        const isTaken = error.message.includes("is there already");
        taken = isTaken ? file : "";
        throw isTaken ? new Error(`${error.message}. Save again to write over it.`) : error;
      }
    });
  }

  async open() {
    try {
      const files = await this.edit.ask("scene_files");
      const dialog = at("ask");
      const groups = Object.entries(KINDS).flatMap(([kind, words]) => (files[kind].length ? [create("h3", { textContent: words }), ...files[kind].map((path) => this.choice(path, dialog))] : []));
      const cancel = create("button", { type: "button", textContent: "Cancel", onclick: () => dialog.close() });
      const list = create("div", { className: "choices" }, ...(groups.length ? groups : ["There is no scene yet."]));
      dialog.replaceChildren(create("h2", { textContent: "Open a scene" }), list, create("div", { className: "buttons" }, cancel));
      dialog.setAttribute("aria-label", "Open a scene");
      dialog.showModal();
    } catch (error) {
      this.edit.wrong(error.message);
    }
  }

  choice(path, dialog) {
    const open = () => {
      dialog.close();
      this.ifSaved(() => this.act("open_scene", { file: path }));
    };
    return create("button", { type: "button", className: "plain", textContent: stem(path), title: path, onclick: open });
  }
}
