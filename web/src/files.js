// New, rename, duplicate, delete, download and upload: what the menu beside Run does with the files of scripts.
import { Menu } from "./menu.js";
import { isLua } from "./editor.js";
import { template } from "./templates.js";

const LARGEST = 1 << 20; // bytes

const stem = (script) => script.split("/").pop().replace(/\.(?:py|lua)$/, "");
const ending = (script) => (isLua(script) ? ".lua" : ".py");

export class Files {
  // `parts`: more, menu, form, label, name, said, confirm, cancel, drop, pick, and the menu's items in `items` by their
  // names. `show` shows messages and questions, as the page's.
  constructor(parts, scripts, show) {
    this.parts = parts;
    this.scripts = scripts;
    this.show = show;
    this.menu = new Menu(parts.more, parts.menu);
    const does = {
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
    for (const [name, action] of Object.entries(does)) parts.items[name].onclick = () => this.attempt(action);
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

  // What is of the package can be neither renamed nor deleted.
  aim() {
    for (const name of ["rename", "delete"]) this.parts.items[name].disabled = !this.scripts.isOwn;
  }

  attempt(action) {
    return Promise.resolve().then(action).catch((error) => this.scripts.store.say("trouble", error.message));
  }

  // A name without an ending gets that of the script.
  named(name, end = ending(this.script)) {
    return /\.(?:py|lua)$/.test(name) ? name : name + end;
  }

  // ---- a name is asked for

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
    const given = name.value.trim();
    if (!given) return void (said.textContent = "Needs a name.");
    this.done(given).then(
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
    const again = ["Undo", () => this.scripts.bringBack(script)];
    const fine = ["OK", async () => this.show({ question: null })];
    this.show({ question: { said: `${script} is deleted.`, choices: [again, fine] } });
  }

  download() {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([this.scripts.editor.text], { type: "text/plain" }));
    link.download = this.script.split("/").pop();
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  }

  listen(place) {
    const isOfFiles = (event) => event.dataTransfer?.types.includes("Files");
    const over = (on) => (event) => {
      if (!isOfFiles(event)) return;
      event.preventDefault();
      place.classList.toggle("drop", on);
    };
    place.addEventListener("dragover", over(true), true);
    place.addEventListener("dragleave", over(false), true);
    place.addEventListener(
      "drop",
      (event) => {
        if (!isOfFiles(event)) return;
        over(false)(event);
        event.stopPropagation(); // the editor would write the file's text where the mouse is
        this.attempt(() => this.upload(event.dataTransfer.files));
      },
      true,
    );
  }

  // The first file is a script; where its name is taken, another one is asked for.
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
