// The scripts: opened, saved by the cockpit soon after every change, compared with the disk, and run. No edit is lost.
import { Drafts } from "./drafts.js";
import { Editor, isLua } from "./editor.js";
import { NOT_STARTED, isSyntaxError } from "./state/store.js";
import { markedLines } from "./state/words.js";
import { keep, kept } from "./storage.js";

const QUIET = 800; // ms without a key before the text is saved
const LOOK = 1000; // ms between two comparisons with the file
const RETRY = 4000; // ms after a failed save before the next attempt
const LARGEST = 1 << 20; // bytes

const DEFAULT = "built-in/pilot.py"; // the script that flies if the launch names none
const SCRIPT = "script"; // the storage key of the open script
const FLOWN = "flown"; // the storage key of the script that the simulator had last
const COPIES = "copies"; // the storage key of the user's latest copy of each script of the package

const size = (text) => new TextEncoder().encode(text).length;

export class Scripts {
  // `page` has show({ lists, script, of, question }); `onOpen(lesson)` is called with the lesson of an opened script.
  /**
   * @param {HTMLElement} parent
   * @param {import("./socket.js").PageSocket} socket
   * @param {import("./state/store.js").Store} store
   */
  constructor(parent, socket, store, page, onOpen, known, onBreakpoints) {
    /** @type {wire.Ask} */
    this.ask = (ask, more) => socket.ask(ask, more);
    this.socket = socket;
    this.store = store;
    this.page = page;
    this.onOpen = onOpen;
    this.drafts = new Drafts();
    const check = async (text, lua) => {
      const { found, unchecked } = socket.open ? await this.ask("check", { text, lua }) : {};
      return unchecked ? null : found; // null: the text is too large, or its check takes too long
    };
    const checked = (found) => this.store.take("checked", { file: this.is.file, found });
    const moved = (line) => this.store.take("moved", line);
    this.editor = new Editor(parent, { change: () => this.change(), run: () => this.onRun(), check, checked, moved, breakpoints: onBreakpoints }, known);
    this.is = { script: "", file: "", version: "", text: "" }; // the open script, as the disk had it last
    this.onRun = () => {}; // called on Ctrl+Enter
    this.dirty = false;
    this.conflict = false;
    this.marked = {}; // the marks that `mark` has set
    /** @type {Promise<unknown>} */
    this.turn = Promise.resolve(); // settles with the last action of inTurn
    setInterval(() => this.watch(), LOOK);
    document.addEventListener("visibilitychange", () => this.watch());
    store.on((now) => this.mark(now));
  }

  // Run an action after all earlier ones: it needs to know the version of the file that they have made.
  /**
   * @template Result
   * @param {() => Promise<Result>} action
   */
  inTurn(action) {
    const done = this.turn.catch(() => {}).then(action);
    this.turn = done;
    return done;
  }

  // ---- the list, and opening

  async list() {
    const lists = await this.ask("scripts");
    this.digest = lists.digest;
    this.page.show({ lists, script: this.is.script || lists.flown });
    this.hear(lists.flown);
    return lists;
  }

  // Handle a new connection: save what was not saved, then, on the first connection, open a script.
  async connected() {
    const isFirst = !this.is.script;
    const last = isFirst ? this.lastOpen() : [];
    const before = kept(FLOWN, null);
    const { flown, groups, folder } = await this.list();
    await this.save().catch(() => {});
    const left = this.drafts.scripts.filter((script) => script !== this.is.script);
    for (const script of left) await this.open(script).catch((error) => this.store.say("trouble", error.message));
    if (!isFirst || this.conflict) return;
    const all = groups.flatMap(({ scripts }) => scripts);
    const isNews = flown !== DEFAULT && flown !== (before ?? flown); // this launch flies another script than the last one
    const firstScript = (isNews ? [flown, ...last] : [...last, flown]).find((one) => all.includes(one));
    if (firstScript && firstScript !== this.is.script) await this.open(firstScript);
    if (firstScript) return;
    await this.open(DEFAULT);
    if (flown) this.store.say("elsewhere", `${flown} flies, from another folder than ${folder}: Upload (⋯) makes a copy that you can edit`);
  }

  // Return the user's copy of the last open script, undefined if there is none, and the last open script.
  lastOpen() {
    const open = kept(SCRIPT, "");
    return [kept(COPIES, {})[open], open];
  }

  // Note which script the simulator has.
  hear(flown) {
    if (flown === this.store.now.flown) return;
    this.store.take("flown", flown);
    keep(FLOWN, flown);
  }

  open(script) {
    return this.save().catch(() => {}).then(() => this.inTurn(() => this.take(script)));
  }

  async take(script) {
    const draft = this.drafts.get(script);
    let failure;
    const answer = await this.ask("open", { script }).catch((error) => {
      this.page.show({ script: this.is.script });
      if (!draft || !this.socket.open) throw error;
      failure = error;
      return { script, file: "", version: "", text: "", lesson: "" };
    });
    this.know(answer);
    this.conflict = this.dirty = false;
    this.page.show({ script, of: answer.lesson, question: null });
    this.editor.show(script, answer.text);
    this.marked = {}; // the marks were those of the previous text
    this.store.take("opened", { script, file: answer.file });
    keep(SCRIPT, script);
    if (draft && draft.text !== answer.text) this.resume(draft, failure);
    else this.drafts.drop(script);
    this.onOpen(answer.lesson);
  }

  // Show a draft that was not saved, and save it; ask the user first if the file has changed since.
  resume(draft, failure) {
    this.editor.fill(draft.text);
    this.editor.restorePlace();
    this.dirty = true;
    if (failure || (draft.version !== this.is.version && this.isOwn)) return this.disagree(failure);
    this.store.say("restored", "what was not saved yet is here again");
    setTimeout(() => this.save().catch(() => {}));
  }

  get isOwn() {
    return this.is.script.startsWith("mine/"); // the others are never overwritten: saving makes a copy
  }

  know({ script, file, version, text = this.editor.text }) {
    this.is = { script, file, version, text };
  }

  // ---- changes by the user

  change() {
    this.dirty = true;
    this.draft();
    this.store.take("edited");
    if (this.conflict) return;
    this.store.take("saving");
    clearTimeout(this.later);
    this.later = setTimeout(() => this.save().catch(() => {}), QUIET);
  }

  // Store the text as a draft. For a script of the package, the draft's name lets the cockpit find the copy it has made already.
  draft() {
    const { script, version } = this.is;
    const { name = Math.random().toString(36).slice(2) } = this.drafts.get(script) ?? {};
    this.drafts.put(script, { text: this.editor.text, version, name });
  }

  save() {
    return this.inTurn(() => this.write());
  }

  async write() {
    if (!this.dirty) return;
    if (this.conflict) throw new Error("first choose which of the two texts is to stay");
    const text = this.editor.text;
    const { script, version } = this.is;
    try {
      if (size(text) > LARGEST) throw new Error(`has more than ${LARGEST} bytes`);
      const answer = await this.ask("save", { script, text, version, draft: this.drafts.get(script)?.name });
      if (answer.changed) return await this.compare();
      if (answer.script !== script) keep(COPIES, { ...kept(COPIES, {}), [script]: answer.script });
      this.written(answer, text);
    } catch (error) {
      this.failed = Date.now();
      this.store.take("unsaved", `not saved: ${error.message}`);
      throw error;
    }
  }

  written(answer, text) {
    const before = this.is.script;
    this.know({ ...answer, text });
    this.drafts.drop(before);
    this.dirty = this.editor.text !== text; // the user has typed more meanwhile
    if (this.dirty) this.draft();
    if (before !== this.is.script) this.editor.rename(this.is.script);
    const { script, file } = this.is;
    this.page.show({ script, of: answer.lesson });
    if (before !== script) this.store.take("renamed", { script, file });
    this.store.take("saved", `saved as ${script}`);
    keep(SCRIPT, script);
    if (before !== this.is.script) return this.list();
  }

  async saveAs(name) {
    await this.inTurn(async () => {
      const text = this.editor.text;
      const answer = await this.ask("save_as", { name, text });
      this.conflict = false;
      this.page.show({ question: null });
      await this.written(answer, text);
    });
  }

  // ---- files

  // Create a script with a text, and open it.
  async create(name, text) {
    await this.save();
    const { script } = await this.inTurn(() => this.ask("save_as", { name, text }));
    await this.list();
    await this.open(script);
  }

  async rename(name) {
    if (name === this.is.script.split("/").pop()) return;
    await this.save();
    await this.inTurn(async () => {
      const { script, text } = this.is;
      const answer = await this.ask("rename", { script, name });
      if (isLua(answer.script) === isLua(script)) return this.written(answer, text);
      // Open the file again, in the other language. A draft keeps what was typed since the save.
      if (this.dirty) this.drafts.put(answer.script, { text: this.editor.text, version: answer.version });
      this.drafts.drop(script);
      this.editor.forget(script);
      await this.list();
      await this.take(answer.script);
    });
  }

  async duplicate() {
    const { script } = await this.inTurn(() => this.ask("duplicate", { script: this.is.script, text: this.editor.text }));
    await this.list();
    await this.open(script);
  }

  // Delete the open script, and open the one that flies, or any other. Return the name of the deleted script.
  async remove() {
    await this.save();
    const { script } = this.is;
    await this.inTurn(() => this.ask("delete", { script }));
    this.drafts.drop(script);
    this.editor.forget(script);
    this.is = { ...this.is, script: "" };
    const { flown, groups } = await this.list();
    const all = groups.flatMap((one) => one.scripts);
    await this.open([flown, "built-in/pilot.py", all[0]].find((one) => all.includes(one)));
    return script;
  }

  async bringBack(name) {
    const { script } = await this.inTurn(() => this.ask("bring back", { script: name }));
    this.page.show({ question: null });
    await this.list();
    await this.open(script);
  }

  // Go to a line of a file; if it belongs to another script, open that first.
  async goTo(file, line) {
    if (file !== this.is.file) {
      const { script } = await this.ask("locate", { file });
      if (!script) throw new Error(`${file} is none of the scripts on the list`);
      await this.open(script);
    }
    this.editor.goTo(line);
  }

  async revert() {
    const { text } = await this.ask("revert", { script: this.is.script });
    if (text === this.editor.text) return;
    this.editor.fill(text);
    this.change();
  }

  // ---- changes by other programs

  watch() {
    if (document.hidden || !this.socket.open || !this.is.script || this.looking) return;
    this.looking = true;
    this.inTurn(() => this.look())
      .catch(() => {})
      .then(() => (this.looking = false));
  }

  async look() {
    const { script, version } = this.is;
    const now = await this.ask("look", { script });
    this.hear(now.flown);
    if (now.digest !== this.digest) await this.list();
    if (this.conflict) return;
    if (now.version !== version) await this.compare();
    else if (this.dirty && Date.now() - (this.failed ?? 0) > RETRY) await this.write();
  }

  // Handle a change of the file by another program: take its text, or ask the user if both texts have changed.
  async compare() {
    const { script } = this.is;
    const theirs = await this.ask("open", { script }).catch((error) => ({ error }));
    if ("error" in theirs && !this.socket.open) throw theirs.error;
    if ("error" in theirs) return this.disagree(theirs.error);
    const isTouched = theirs.text === this.is.text || !this.isOwn; // no conflict: only the version differs, or saving makes a copy
    const isOurs = theirs.text === this.editor.text;
    if (this.dirty && !isTouched && !isOurs) return this.disagree();
    this.know(theirs);
    if (this.dirty && !isOurs) return this.write(); // with the version of the changed file
    this.dirty = false;
    this.drafts.drop(script);
    if (isOurs) return;
    this.editor.fill(theirs.text);
    this.store.take("saved", "");
    this.store.say("replaced", `${script} has been changed by another program: this is the new text. Ctrl+Z brings yours back.`);
  }

  disagree(failure) {
    this.conflict = true;
    const { script } = this.is;
    const isGone = failure?.kind === "NoSuchScript";
    const keep = (mine) => () => this.keep(mine);
    this.draft();
    const said = isGone
      ? `${script} has been removed or renamed by another program. Its text is still here.`
      : failure?.message ?? `${script} has been changed by another program while you wrote. Both texts will be kept; which stays under this name?`;
    const again = ["Write it again", keep(true)];
    const others = isGone ? ["Let it go", () => this.letGo()] : ["The other's", keep(false)];
    const choices = failure && !isGone ? [again] : [isGone ? again : ["Mine", keep(true)], others];
    this.store.take("unsaved", "not saved");
    this.page.show({ question: { said, choices } });
  }

  async keep(mine) {
    await this.inTurn(async () => {
      const answer = await this.ask("keep", { script: this.is.script, text: this.editor.text, mine });
      this.conflict = this.dirty = false;
      this.drafts.drop(this.is.script);
      this.editor.fill(answer.text);
      this.know(answer);
      const other = answer.other ? `${mine ? "the other's" : "your"} text is in ${answer.other}` : "";
      this.page.show({ question: null });
      this.store.take("saved", `saved as ${answer.script}`);
      this.store.say("kept", other);
      await this.list();
    });
  }

  letGo() {
    this.drafts.drop(this.is.script);
    this.conflict = this.dirty = false;
    this.is = { ...this.is, script: "" };
    this.page.show({ question: null });
    return this.connected();
  }

  // ---- running

  // Save the open script and run it, unless it has a syntax error. With `mayAsk`, a run that would leave the user's scene for
  // that of the lesson is not started; the name of the lesson's scene is returned.
  async run(lesson, mayAsk) {
    await this.save();
    const wrong = (await this.editor.check()).find(isSyntaxError);
    if (wrong) {
      this.store.take("failure", { file: this.is.file, line: wrong.line, said: wrong.said, phase: NOT_STARTED });
      return this.editor.goTo(wrong.line);
    }
    const { script } = this.is;
    this.store.take("run");
    this.store.say("starting", `starting ${script} ...`);
    const { done, said, failure, leaves } = await this.ask("run", { script, lesson, may_ask: mayAsk });
    this.store.take("answered");
    if (leaves) return leaves;
    if (done) this.hear(script);
    if (failure) this.store.take("failure", failure);
    else this.store.say(done ? "started" : "refused", said);
  }

  // Mark the lines at which the open script failed, and at which it is paused. The editor moves the marks with the text.
  mark(now) {
    const { failed, paused } = markedLines(now);
    const failure = failed && `${now.failure.told} ${now.failure.said}`;
    if (failure !== this.marked.failure) this.editor.mark(failed ? now.failure : null);
    if (paused !== this.marked.paused) this.editor.paused(paused);
    this.marked = { failure, paused };
  }
}
