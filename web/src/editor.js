// The text of one script at a time; each keeps its own cursor and its own history of changes.
import { basicSetup } from "codemirror";
import { indentWithTab } from "@codemirror/commands";
import { EditorState, Prec } from "@codemirror/state";
import { EditorView, keymap } from "@codemirror/view";
import { StreamLanguage, indentUnit } from "@codemirror/language";
import { forEachDiagnostic, setDiagnostics } from "@codemirror/lint";
import { python } from "@codemirror/lang-python";
import { lua } from "@codemirror/legacy-modes/mode/lua";

export class Editor {
  constructor(parent, onChange, onRun) {
    this.states = new Map(); // of scripts that have been open, by name
    this.script = "";
    const changed = EditorView.updateListener.of((update) => {
      if (!update.docChanged || this.filling) return;
      this.unmark(update);
      onChange();
    });
    const run = { key: "Mod-Enter", run: () => (onRun(), true) }; // else it would begin a line, too
    this.common = [
      Prec.highest(keymap.of([run])),
      basicSetup,
      keymap.of([indentWithTab]),
      indentUnit.of("    "),
      EditorView.contentAttributes.of({ "aria-label": "Text of the child script; Escape and then Tab leaves it" }),
      changed,
    ];
    this.view = new EditorView({ parent, state: this.begin("", "") });
  }

  begin(script, text) {
    const language = script.endsWith(".lua") ? StreamLanguage.define(lua) : python();
    return EditorState.create({ doc: text, extensions: [this.common, language] });
  }

  get text() {
    return this.view.state.doc.toString();
  }

  // Shows a script where it was left; its text is what the disk has now.
  show(script, text) {
    this.leave();
    this.script = script;
    const known = this.states.get(script);
    this.view.setState(known?.state ?? this.begin(script, text));
    this.fill(text);
    if (known) this.view.dispatch({ effects: known.scroll });
  }

  leave() {
    if (this.script) this.states.set(this.script, { state: this.view.state, scroll: this.view.scrollSnapshot() });
  }

  rename(script) {
    this.states.delete(this.script);
    this.script = script;
  }

  // Puts another text there, as one change that can be undone; what is the same stays, and the cursor with it.
  fill(text) {
    const before = this.text;
    this.mark(null);
    if (text === before) return;
    const most = Math.min(text.length, before.length);
    let from = 0;
    while (from < most && text[from] === before[from]) from++;
    let end = 0;
    while (end < most - from && text[text.length - 1 - end] === before[before.length - 1 - end]) end++;
    this.filling = true;
    const insert = text.slice(from, text.length - end);
    this.view.dispatch({ changes: { from, to: before.length - end, insert } });
    this.filling = false;
  }

  // A failure in a line that is written anew is none of that line any more.
  unmark({ startState, changes }) {
    forEachDiagnostic(startState, (_, from, to) => changes.touchesRange(from, to) && this.mark(null));
  }

  // Shows a failure at its line, or none.
  mark(failure) {
    const doc = this.view.state.doc;
    const found = [];
    if (failure && failure.line >= 1 && failure.line <= doc.lines) {
      const { from, to } = doc.line(failure.line);
      found.push({ from, to, severity: "error", message: failure.said });
      this.view.dispatch({ effects: EditorView.scrollIntoView(from, { y: "center" }) });
    }
    this.view.dispatch(setDiagnostics(this.view.state, found));
  }
}
