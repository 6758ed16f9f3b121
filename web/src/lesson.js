// The text beside the script: a section of the tutorial, or a task. What it says of a scene, Run flies in.
import { render } from "./markdown.js";
import { hasFunctions } from "./snippets.js";

const ASK_AGAIN = 500; // ms, for what is being graded

function showGrade(element, script, { error, points, of, rows = [] }) {
  const table = document.createElement("table");
  for (const one of rows) {
    const row = table.insertRow();
    row.className = one.passed ? "passed" : "failed";
    for (const cell of [one.passed ? "ok" : "no", one.name, `${one.points}/${one.of}`, one.said]) row.insertCell().textContent = cell;
  }
  const sum = rows.length ? `${script}: ${points} of ${of} points` : "";
  element.replaceChildren([sum, error].filter(Boolean).join(". "), table);
}

export class Lesson {
  // `parts` are elements: choice, before, after, fold, body, start, flies, grade, graded, text. Of `script`, `open` opens one,
  // `save` saves it, `put` puts lines of Python into it, `run` flies it.
  constructor(parts, ask, { open, save, put, run }) {
    Object.assign(this, { parts, ask, open, save, put, run });
    this.all = []; // { lesson, title, task, script } in the order of reading
    this.name = "";
    this.opened = { script: "", lesson: "" };
    parts.choice.onchange = () => this.take(parts.choice.value);
    parts.before.onclick = () => this.turn(-1);
    parts.after.onclick = () => this.turn(1);
    parts.fold.onclick = () => this.folded(!parts.body.hidden);
    parts.start.onclick = () => open(this.script);
    parts.grade.onclick = () => this.grade();
  }

  offer(all) {
    if (JSON.stringify(all) === JSON.stringify(this.all)) return;
    this.all = all;
    const group = (label, some) => {
      const made = document.createElement("optgroup");
      made.label = label;
      made.append(...some.map(({ lesson, title }) => new Option(title, lesson)));
      return made;
    };
    const groups = [group("tutorial", all.filter((one) => !one.task)), group("tasks", all.filter((one) => one.task))];
    this.parts.choice.replaceChildren(new Option("Tutorial and tasks ...", ""), ...groups);
    this.parts.choice.value = this.name;
    this.aim();
  }

  // Shows a text, none for ''. `script` is the one that is in the editor.
  async show(name) {
    if (name === this.name) return;
    this.name = name;
    this.parts.choice.value = name;
    this.aim();
    if (!name) return this.folded(true);
    const { text, folder, script, flies } = await this.ask("lesson", { lesson: name });
    if (name !== this.name) return; // another one has been chosen meanwhile
    this.parts.graded.replaceChildren();
    this.script = this.opened.lesson === name ? this.opened.script : script; // there may be several
    this.parts.flies.textContent = flies && `Run flies ${flies}.`;
    this.folded(false);
    const knows = (to) => to.script || this.all.some((one) => one.lesson === to.lesson);
    render(this.parts.text, text, folder, knows, (to) => (to.script ? this.open(to.script) : this.take(to.lesson)), (code) => this.actions(code));
    this.parts.body.scrollTop = 0;
    this.aim();
  }

  go(name) {
    return this.show(name).catch((error) => {
      this.parts.flies.textContent = error.message;
    });
  }

  // What can be done with lines of Python in the text.
  actions(code) {
    const put = { label: "Put into the script", title: "Replaces the function of the same name; other lines go to the cursor", act: () => this.put(code) };
    const run = { label: "Run", title: "Put it into the script, and fly", act: () => this.put(code) && this.run() };
    return hasFunctions(code) ? [put, run] : [put];
  }

  // Goes to a text, and to its script where it has one.
  async take(name) {
    await this.go(name);
    if (name === this.name && this.script && this.opened.lesson !== name) this.open(this.script);
  }

  async turn(way) {
    const next = this.all[this.place + way];
    if (next) await this.take(next.lesson);
  }

  // Grades the script by this task, beside what flies, and shows how it did.
  async grade() {
    const { grade, graded } = this.parts;
    const task = this.name;
    grade.disabled = true;
    graded.textContent = "flying without pictures ...";
    try {
      await this.save();
      const { script } = this.opened;
      const { number } = await this.ask("grade", { script, lesson: task });
      let result = {};
      while (!("error" in result)) {
        await new Promise((resolve) => setTimeout(resolve, ASK_AGAIN));
        result = await this.ask("graded", { number });
      }
      if (task === this.name) showGrade(graded, script, result);
    } catch (error) {
      graded.textContent = error.message;
    } finally {
      grade.disabled = false;
    }
  }

  get place() {
    return this.all.findIndex((one) => one.lesson === this.name);
  }

  // Hears which script is in the editor, and to which text it belongs: no button is needed for that.
  has(script, lesson) {
    this.opened = { script, lesson };
    if (lesson && lesson === this.name) this.script = script;
    this.aim();
  }

  aim() {
    const { before, after, start, grade } = this.parts;
    grade.hidden = !this.all[this.place]?.task;
    before.disabled = this.place <= 0;
    after.disabled = this.place + 1 >= this.all.length;
    start.hidden = !this.name || !this.script || this.opened.lesson === this.name;
    start.textContent = `Open ${this.script}`;
  }

  folded(is) {
    this.parts.body.hidden = is || !this.name;
    this.parts.fold.setAttribute("aria-expanded", String(!this.parts.body.hidden));
    this.parts.fold.disabled = !this.name;
  }
}
