// The file menu beside Run: new, save as, rename, duplicate, download, upload, revert and delete.
import { Menu } from "./menu.js";
import { isLua } from "./editor.js";
import { template } from "./templates.js";

const LARGEST = 1 << 20; // bytes

const stem = (script) => script.split("/").pop().replace(/\.(?:py|lua)$/, "");
const ending = (script) => (isLua(script) ? ".lua" : ".py");

export class Files {
  // `parts` are elements: more, menu, form, label, name, said, cancel, drop, pick, and the menu's items in `items`, by name.
  // `show` is the page's show(): it displays questions to the user.
  constructor(parts, scripts, show) {
    this.parts = parts;
    this.scripts = scripts;
    this.show = show;
    this.menu = new Menu(parts.more, parts.menu);
    const actions = {
      "new-python": () => this.begin("Name of the new script", "my_script", (name) => scripts.create(this.named(name, ".py"), template(false))),
      "new-lua": () => this.begin("Name of the new script", "my_script", (name) => scripts.create(this.named(name, ".lua"), template(true))),
      as: () => this.begin("Save as", stem(this.script), (name) => scripts.saveAs(this.named(name))),
      rename: () => this.begin("New name", stem(this.script), (name) => scripts.rename(this.named(name))),
      duplicate: () => scripts.duplicate(),
      download: () => this.download(),
      upload: () => parts.pick.click(),
      revert: () => scripts.revert(),
      delete: () => this.remove(),
    };
    for (const [name, action] of Object.entries(actions)) parts.items[name].onclick = () => this.attempt(action);
    parts.more.addEventListener("click", () => this.aim());
    parts.form.onsubmit = (event) => {
      event.preventDefault();
      this.finish();
    };
    parts.cancel.onclick = () => this.close();
    parts.name.oninput = () => (parts.said.textContent = "");
    parts.form.onkeydown = (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.close();
    };
    parts.pick.onchange = () => this.attempt(() => this.upload(parts.pick.files)).then(() => (parts.pick.value = ""));
    this.listen(parts.drop);
  }

  get script() {
    return this.scripts.is.script;
  }

  // Disable Rename and Delete for scripts of the package.
  aim() {
    for (const name of ["rename", "delete"]) this.parts.items[name].disabled = !this.scripts.isOwn;
  }

  attempt(action) {
    return Promise.resolve().then(action).catch((error) => this.scripts.store.say("trouble", error.message));
  }

  // Return `name` with an ending: its own, or else `end`, by default that of the open script.
  named(name, end = ending(this.script)) {
    return /\.(?:py|lua)$/.test(name) ? name : name + end;
  }

  // ---- the form for a name

  begin(label, name, done) {
    const { form, label: shown, name: field, said } = this.parts;
    this.done = done;
    shown.textContent = label;
    field.value = name;
    said.textContent = "";
    form.hidden = false;
    field.select();
  }

  finish() {
    const { name, said } = this.parts;
    const newName = name.value.trim();
    if (!newName) return void (said.textContent = "Needs a name.");
    this.done(newName).then(
      () => this.close(),
      (error) => {
        said.textContent = error.message; // beside the name
        name.select();
      },
    );
  }

  close() {
    this.parts.form.hidden = true;
    this.scripts.editor.view.focus();
  }

  // ---- files

  async remove() {
    const script = await this.scripts.remove();
    const undo = ["Undo", () => this.scripts.bringBack(script)];
    const accept = ["OK", async () => this.show({ question: null })];
    this.show({ question: { said: `${script} is deleted.`, choices: [undo, accept] } });
  }

  download() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.scripts.editor.text], { type: "text/plain" }));
    link.download = this.script.split("/").pop();
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  listen(place) {
    const hasFiles = (event) => event.dataTransfer?.types.includes("Files");
    const dragHandler = (on) => (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      place.classList.toggle("drop", on);
    };
    place.addEventListener("dragover", dragHandler(true), true);
    place.addEventListener("dragleave", dragHandler(false), true);
    place.addEventListener(
      "drop",
      (event) => {
        if (!hasFiles(event)) return;
        dragHandler(false)(event);
        event.stopPropagation(); // otherwise the editor would insert the file's text at the pointer
        this.attempt(() => this.upload(event.dataTransfer.files));
      },
      true,
    );
  }

  // Upload the first file as a script. If that fails, for example because its name is taken, ask for another name.
  async upload([file]) {
    if (!file) return;
    if (!/\.(?:py|lua)$/.test(file.name)) throw new Error(`${file.name}: a script's name ends in .py or .lua`);
    if (file.size > LARGEST) throw new Error(`${file.name}: has ${file.size} bytes; at most ${LARGEST} are kept`);
    const text = (await file.text()).replaceAll("\r\n", "\n");
    const create = (name) => this.scripts.create(this.named(name, ending(file.name)), text);
    await create(file.name).catch((error) => {
      this.begin("Name in your folder", stem(file.name), create);
      this.parts.said.textContent = error.message;
    });
  }
}
