// The scripts: opened, written to the node's disk soon after every change, watched, and flown. No edit is ever lost.
import { Drafts } from "./drafts.js";
import { Editor, isLua } from "./editor.js";
import { NOT_STARTED, isSyntaxError } from "./state/store.js";
import { markedLines } from "./state/words.js";
import { keep, kept } from "./storage.js";

const QUIET = 800; // ms without a key before it is saved
const LOOK = 1000; // ms between two looks at the file
const RETRY = 4000; // ms after which what could not be saved is tried again
const LARGEST = 1 << 20; // bytes

const DEFAULT = "built-in/pilot.py"; // flies if the launch names no script
const SCRIPT = "script"; // the storage key of the open script
const FLOWN = "flown"; // the storage key of the script that the simulator had last
const COPIES = "copies"; // the storage key of the user's latest copy of each script of the package

const size = (text) => new TextEncoder().encode(text).length;

export class Scripts {
  // `page` has show({ lists, script, of, question }); `onOpen` hears of the text that a script has.
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
      return unchecked ? null : found; // of a text that is too large, or takes too long, nothing is known
    };
    const checked = (found) => this.store.take("checked", { file: this.is.file, found });
    const moved = (line) => this.store.take("moved", line);
    this.editor = new Editor(parent, { change: () => this.change(), run: () => this.onRun(), check, checked, moved, breakpoints: onBreakpoints }, known);
    this.is = { script: "", file: "", version: "", text: "" }; // what the disk has, as far as we know
    this.onRun = () => {}; // what Ctrl+Enter does
    this.dirty = false;
    this.conflict = false;
    this.marked = {}; // what `mark` has shown
    /** @type {Promise<unknown>} */
    this.turn = Promise.resolve(); // of whatever was done last
    setInterval(() => this.watch(), LOOK);
    document.addEventListener("visibilitychange", () => this.watch());
    store.on((now) => this.mark(now));
  }

  // One after the other: the second would not know the version that the first has made.
  /**
   * @template Result
   * @param {() => Promise<Result>} action
   */
  inTurn(action) {
    const done = this.turn.catch(() => {}).then(action);
    this.turn = done;
    return done;
  }

  // ---- what there is

  async list() {
    const lists = await this.ask("scripts");
    this.digest = lists.digest;
    this.page.show({ lists, script: this.is.script || lists.flown });
    this.hear(lists.flown);
    return lists;
  }

  // After the connection is there, again: what was not saved comes first.
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
    const isNews = flown !== DEFAULT && flown !== (before ?? flown); // another launch flies another script
    const found = (isNews ? [flown, ...last] : [...last, flown]).find((one) => all.includes(one));
    if (found && found !== this.is.script) await this.open(found);
    if (found) return;
    await this.open(DEFAULT);
    if (flown) this.store.say("elsewhere", `${flown} flies, from another folder than ${folder}: Upload (⋯) makes a copy that you can edit`);
  }

  // Returns the user's copy of the last open script, if the user has changed a script of the package, and that script.
  lastOpen() {
    const open = kept(SCRIPT, "");
    return [kept(COPIES, {})[open], open];
  }

  // Hears which script the simulator has.
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
    this.marked = {}; // those of the text that was shown before
    this.store.take("opened", { script, file: answer.file });
    keep(SCRIPT, script);
    if (draft && draft.text !== answer.text) this.resume(draft, failure);
    else this.drafts.drop(script);
    this.onOpen(answer.lesson);
  }

  // Goes on with what was not saved.
  resume(draft, failure) {
    this.editor.fill(draft.text);
    this.editor.restorePlace();
    this.dirty = true;
    if (failure || (draft.version !== this.is.version && this.isOwn)) return this.disagree(failure);
    this.store.say("restored", "what was not saved yet is here again");
    setTimeout(() => this.save().catch(() => {}));
  }

  get isOwn() {
    return this.is.script.startsWith("mine/"); // all others are never written: they become a copy
  }

  know({ script, file, version, text = this.editor.text }) {
    this.is = { script, file, version, text };
  }

  // ---- what is changed here

  change() {
    this.dirty = true;
    this.draft();
    this.store.take("edited");
    if (this.conflict) return;
    this.store.take("saving");
    clearTimeout(this.later);
    this.later = setTimeout(() => this.save().catch(() => {}), QUIET);
  }

  // Its name lets the cockpit find the copy of a script of the package that it has made of an earlier text.
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
    this.dirty = this.editor.text !== text; // more has been written meanwhile
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

  // Makes a new script with a text, and opens it.
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
      // The editor opens the file again in the other language; what was typed since the save goes with it.
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

  // Deletes the script that is shown, and opens the one that flies, or any other; returns what it was called.
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

  // Goes to a line of a file, be it that of another script.
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

  // ---- what others change

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

  // The file is not what we have last seen: it is told, and nothing of either text is lost.
  async compare() {
    const { script } = this.is;
    const theirs = await this.ask("open", { script }).catch((error) => ({ error }));
    if ("error" in theirs && !this.socket.open) throw theirs.error;
    if ("error" in theirs) return this.disagree(theirs.error);
    const isTouched = theirs.text === this.is.text || !this.isOwn; // another version of the same
    const isOurs = theirs.text === this.editor.text;
    if (this.dirty && !isTouched && !isOurs) return this.disagree();
    this.know(theirs);
    if (this.dirty && !isOurs) return this.write(); // with the version of now
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
    const gone = failure?.kind === "NoSuchScript";
    const keep = (mine) => () => this.keep(mine);
    this.drafts.put(script, { text: this.editor.text, version: this.is.version });
    const said = gone
      ? `${script} has been removed or renamed by another program. Its text is still here.`
      : failure?.message ?? `${script} has been changed by another program while you wrote. Both texts will be kept; which stays under this name?`;
    const again = ["Write it again", keep(true)];
    const others = gone ? ["Let it go", () => this.letGo()] : ["The other's", keep(false)];
    const choices = failure && !gone ? [again] : [gone ? again : ["Mine", keep(true)], others];
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

  // ---- flown

  // Saves what is shown, and flies that, unless it cannot even be read. With `mayAsk`, nothing happens if that would leave
  // a scene of the user's; the name of the text's scene is returned then.
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

  // Marks the lines at which the open script failed, and at which it is paused. The editor moves the marks with the text.
  mark(now) {
    const { failed, paused } = markedLines(now);
    const failure = failed && `${now.failure.told} ${now.failure.said}`;
    if (failure !== this.marked.failure) this.editor.mark(failed ? now.failure : null);
    if (paused !== this.marked.paused) this.editor.paused(paused);
    this.marked = { failure, paused };
  }
}
