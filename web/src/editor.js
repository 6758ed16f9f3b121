// The child script: written to the node's disk soon after every change, so that nothing is lost.
import { basicSetup } from "codemirror";
import { EditorView } from "@codemirror/view";
import { Compartment } from "@codemirror/state";
import { StreamLanguage } from "@codemirror/language";
import { setDiagnostics } from "@codemirror/lint";
import { python } from "@codemirror/lang-python";
import { lua } from "@codemirror/legacy-modes/mode/lua";

const QUIET = 800; // ms without a key before it is saved

export class Editor {
  constructor(parent, ask, show) {
    this.ask = ask;
    this.show = show; // { saved, said, bad, scripts, script }
    this.language = new Compartment();
    this.script = "";
    this.version = "";
    this.dirty = false;
    this.saving = Promise.resolve();
    const changed = EditorView.updateListener.of((update) => update.docChanged && !this.filling && this.change());
    this.view = new EditorView({ parent, extensions: [basicSetup, this.language.of([]), changed] });
  }

  get text() {
    return this.view.state.doc.toString();
  }

  fill(text) {
    this.filling = true;
    this.view.dispatch({ changes: { from: 0, to: this.view.state.doc.length, insert: text } });
    this.filling = false;
    this.mark(null);
  }

  async list() {
    const { scripts, flown } = await this.ask("scripts");
    this.show({ scripts, script: this.script || flown });
    return flown;
  }

  async open(script) {
    await this.save();
    const answer = await this.ask("open", { script });
    this.script = answer.script;
    this.version = answer.version;
    this.fill(answer.text);
    const kind = this.script.endsWith(".lua") ? StreamLanguage.define(lua) : python();
    this.view.dispatch({ effects: this.language.reconfigure(kind) });
    this.dirty = false;
    this.show({ saved: "", script: this.script });
  }

  change() {
    this.dirty = true;
    this.show({ saved: "..." });
    clearTimeout(this.later);
    this.later = setTimeout(() => this.save().catch(() => {}), QUIET);
  }

  // One after the other: the second would not know the version of the first.
  save() {
    this.saving = this.saving.catch(() => {}).then(() => this.write());
    return this.saving;
  }

  async write() {
    if (!this.dirty) return;
    this.dirty = false;
    try {
      const before = this.script;
      const answer = await this.ask("save", { script: this.script, text: this.text, version: this.version });
      this.script = answer.script;
      this.version = answer.version;
      this.show({ saved: `saved as ${answer.script}` });
      if (before !== answer.script) await this.list();
    } catch (error) {
      this.dirty = true;
      this.show({ saved: error.message, bad: true });
      throw error;
    }
  }

  async revert() {
    const { text } = await this.ask("revert", { script: this.script });
    this.fill(text);
    this.change();
  }

  async run() {
    await this.save();
    this.mark(null);
    this.show({ said: "starting ..." });
    const { done, said, line } = await this.ask("run", { script: this.script });
    this.show({ said, bad: !done });
    if (line) this.mark({ line, said });
  }

  // Shows a failure at its line, or none.
  mark(failure) {
    const doc = this.view.state.doc;
    const found = [];
    if (failure && failure.line <= doc.lines) {
      const { from, to } = doc.line(failure.line);
      found.push({ from, to, severity: "error", message: failure.said });
      this.view.dispatch({ effects: EditorView.scrollIntoView(from, { y: "center" }) });
    }
    this.view.dispatch(setDiagnostics(this.view.state, found));
  }
}
