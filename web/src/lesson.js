// The lesson above the script: a section of the tutorial, or a task. If a lesson has a scene, Run flies in that scene.
import { create } from "./dom.js";
import { keepBest, showGrade, showProgress } from "./graded.js";
import { render } from "./markdown.js";
import { hasFunctions } from "./snippets.js";
import { forget, keep, kept } from "./storage.js";

const ASK_AGAIN = 500; // ms between two requests for the state of a grade
const GRADE = "grade"; // the storage key of the last grade: { task, script, number, isOld }; a reloaded page continues it

export class Lesson {
  // `parts` are elements: choice, before, after, fold, body, start, flies, grade, handIn, graded, text. `open(script)` opens
  // a script; `save()` saves the open script, `put(code)` puts Python into it, and `run()` runs it. `replay(folder, flight,
  // seed, second)` shows a graded flight in the scene.
  /**
   * @param {import("./state/store.js").Store} store
   * @param {wire.Ask} ask
   */
  constructor(parts, store, ask, { open, save, put, run, replay }) {
    this.parts = parts;
    this.store = store;
    this.ask = ask;
    this.open = open;
    this.save = save;
    this.put = put;
    this.run = run;
    this.replay = replay;
    this.graded = kept(GRADE, null);
    this.result = null; // the result of this.graded, null during its flights
    this.edits = 0; // the store's count of edits when the graded script was saved
    this.all = []; // { lesson, title, task, script } in reading order
    this.name = "";
    this.hasFailed = false; // whether the request for this lesson failed, so that the text and script are another lesson's
    this.taken = ""; // the lesson that the user has chosen, until it is shown
    this.opened = { script: "", lesson: "" };
    parts.choice.onchange = () => this.take(parts.choice.value);
    parts.before.onclick = () => this.turn(-1);
    parts.after.onclick = () => this.turn(1);
    parts.fold.onclick = () => this.folded(!parts.body.hidden);
    parts.start.onclick = () => open(this.script);
    parts.grade.onclick = (event) => this.grade(event.detail === 0);
    parts.handIn.onclick = () => this.handIn();
    store.on((now) => this.age(now));
  }

  offer(all) {
    if (JSON.stringify(all) === JSON.stringify(this.all)) return;
    this.all = all;
    const group = (label, lessons) => {
      const element = document.createElement("optgroup");
      element.label = label;
      element.append(...lessons.map(({ lesson, title }) => new Option(title, lesson)));
      return element;
    };
    const groups = [group("tutorial", all.filter((one) => !one.task)), group("tasks", all.filter((one) => one.task))];
    this.parts.choice.replaceChildren(new Option("Tutorial and tasks ...", ""), ...groups);
    this.parts.choice.value = this.name;
    this.aim();
  }

  // Show a lesson; "" shows none. Its script is the open script if that belongs to the lesson.
  async show(name) {
    if (name === this.name && !this.hasFailed) return;
    this.hasFailed = false;
    this.name = name;
    this.parts.choice.value = name;
    this.aim();
    if (!name) return this.folded(true);
    const { text, folder, script, flies } = await this.ask("lesson", { lesson: name });
    if (name !== this.name) return; // another lesson has been chosen meanwhile
    this.showGraded();
    this.script = this.opened.lesson === name ? this.opened.script : script; // a lesson may have several scripts
    this.parts.flies.textContent = flies && `Run flies ${flies}.`;
    this.folded(false);
    const knows = (to) => to.script || this.all.some((one) => one.lesson === to.lesson);
    render(this.parts.text, text, folder, knows, (to) => (to.script ? this.open(to.script) : this.take(to.lesson)), (code) => this.actions(code));
    this.parts.body.scrollTop = 0;
    this.aim();
  }

  go(name) {
    return this.show(name).catch((error) => {
      if (this.name === name) this.hasFailed = true;
      this.parts.flies.textContent = error.message;
    });
  }

  // Return the buttons for a block of Python in the lesson.
  actions(code) {
    const put = { label: "Put into the script", title: "Replaces the function of the same name; other lines go to the cursor", act: () => this.put(code) };
    const run = { label: "Run", title: "Put it into the script, and fly", act: () => this.put(code) && this.run() };
    return hasFunctions(code) ? [put, run] : [put];
  }

  // Show the lesson of the script that has been opened, unless the user has chosen another lesson meanwhile.
  follow(name) {
    return this.taken && this.taken !== name ? Promise.resolve() : this.go(name);
  }

  // Show a lesson, and open its script if it has one.
  async take(name) {
    this.taken = name;
    await this.go(name);
    if (this.taken === name) this.taken = "";
    if (name && name === this.name && !this.hasFailed && this.script && this.opened.lesson !== name) this.open(this.script);
  }

  async turn(way) {
    const next = this.all[this.place + way];
    if (next) await this.take(next.lesson);
  }

  // ---- grades

  // Grade the script by this task and show the result; the current flight goes on. With `byKey`, the button keeps the focus.
  async grade(byKey) {
    const task = this.name;
    this.store.take("grading", true);
    showProgress(this.parts.graded, {});
    try {
      await this.save();
      const { script } = this.opened;
      this.edits = this.store.now.edits;
      const { number } = await this.ask("grade", { script, lesson: task });
      this.graded = { task, script, number, isOld: false };
      this.result = null;
      keep(GRADE, this.graded);
    } catch (error) {
      this.store.take("grading", false);
      this.parts.graded.textContent = error.message;
      return;
    }
    await this.followGrade();
    if (byKey && document.activeElement === document.body) this.parts.grade.focus(); // the disabled button lost it
  }

  // Save the script and copy it to the folder of the course.
  async handIn() {
    const task = this.name;
    let message;
    try {
      await this.save();
      const { script } = this.opened;
      const { time, digest } = await this.ask("hand in", { script, lesson: task });
      const at = new Date(time.replaceAll(".", ":")).toLocaleString();
      message = `${script} handed in: ${at}, digest ${digest}. You can hand in again: the last copy counts.`;
    } catch (error) {
      message = error.message;
    }
    const { graded } = this.parts;
    if (task !== this.name) return;
    graded.querySelector(".handed-in")?.remove();
    graded.prepend(create("p", { className: "handed-in" }, message));
  }

  // Continue with a grade that was started before the page was loaded, or before the connection was lost.
  connected() {
    if (this.graded && !this.result) this.followGrade(true);
  }

  async followGrade(isOfBefore = false) {
    const { number } = this.graded;
    this.store.take("grading", true);
    this.showGraded();
    try {
      let result = await this.ask("graded", { number });
      while (!("problem" in result)) {
        if (this.graded?.task === this.name) showProgress(this.parts.graded, result);
        await new Promise((resolve) => setTimeout(resolve, ASK_AGAIN));
        result = await this.ask("graded", { number });
      }
      this.result = result;
      keepBest(this.graded.task, result);
      this.showGraded();
    } catch (error) {
      this.forgetGrade(isOfBefore ? "" : error.message);
    } finally {
      this.store.take("grading", false);
    }
  }

  // Forget a grade that the cockpit does not know: it was restarted, or has graded another script. A lost connection ends none.
  forgetGrade(why) {
    if (this.store.now.connection !== "connected") return;
    forget(GRADE);
    this.graded = null;
    this.parts.graded.textContent = why;
  }

  showGraded() {
    const { graded } = this.parts;
    if (this.graded?.task !== this.name) graded.replaceChildren();
    else if (this.result) showGrade(graded, this.graded, this.result, this.replay);
    else showProgress(graded, {});
  }

  // Mark the grade as old when the graded script is changed.
  age({ open, edits }) {
    if (!this.graded || this.graded.isOld || open.script !== this.graded.script || edits === this.edits) return;
    this.graded.isOld = true;
    keep(GRADE, this.graded);
    this.showGraded();
  }

  get place() {
    return this.all.findIndex((one) => one.lesson === this.name);
  }

  // Set the open script and its lesson, and update the buttons: a script that is open needs no button to open it.
  has(script, lesson) {
    this.opened = { script, lesson };
    if (lesson && lesson === this.name) this.script = script;
    this.aim();
  }

  aim() {
    const { before, after, start, grade, handIn } = this.parts;
    grade.hidden = !this.all[this.place]?.task;
    handIn.hidden = !this.all[this.place]?.hands_in;
    before.disabled = this.place <= 0;
    after.disabled = this.place + 1 >= this.all.length;
    start.hidden = !this.name || !this.script || this.opened.lesson === this.name;
    start.textContent = `Open ${this.script}`;
  }

  folded(is) {
    this.parts.body.hidden = is || !this.name;
    this.parts.fold.textContent = this.parts.body.hidden ? "Text" : "Code only";
    this.parts.fold.setAttribute("aria-expanded", String(!this.parts.body.hidden));
    this.parts.fold.disabled = !this.name;
  }
}
