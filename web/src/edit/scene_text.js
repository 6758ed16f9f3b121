// Text editor for the scene. Changes of the text and of the scene update each other; an error is shown at its line.
import { basicSetup } from "codemirror";
import { indentWithTab } from "@codemirror/commands";
import { StreamLanguage, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { setDiagnostics } from "@codemirror/lint";
import { yaml } from "@codemirror/legacy-modes/mode/yaml";
import { EditorState, Transaction } from "@codemirror/state";
import { EditorView, keymap } from "@codemirror/view";
import { create } from "../dom.js";
import { colors, fillWith } from "../editor.js";

const QUIET = 700; // ms without a key before the text is sent to the node; when it loses the focus, it is sent at once

export class SceneText {
  // `parts` are elements: part (the whole), text, said (the message), title, question.
  /** @param {import("./edit.js").Edit} edit */
  constructor(parts, edit) {
    this.parts = parts;
    this.edit = edit;
    /** @type {EditorView | undefined} */
    this.made = undefined;
    /** @type {number | undefined} */
    this.revision = undefined;
    this.dirty = false;
    edit.on("objects", () => this.follow());
  }

  get isShown() {
    return !this.parts.part.hidden;
  }

  show(on) {
    this.parts.part.hidden = !on;
    if (on) this.read();
  }

  // The editor, created when the text is first shown.
  get view() {
    return (this.made ??= this.begin());
  }

  begin() {
    const changed = EditorView.updateListener.of((update) => update.docChanged && !this.filling && this.change());
    const left = EditorView.domEventHandlers({ blur: () => void this.write() }); // before the user's next action, such as a start
    const label = EditorView.contentAttributes.of({ tabindex: "0", "aria-label": "Text of the scene; Escape and then Tab leaves it" });
    const extensions = [basicSetup, EditorView.lineWrapping, StreamLanguage.define(yaml), syntaxHighlighting(colors), keymap.of([indentWithTab]), indentUnit.of("  "), label, left, changed];
    return new EditorView({ parent: this.parts.text, state: EditorState.create({ extensions }) });
  }

  get text() {
    return this.view.state.doc.toString();
  }

  // ---- from the scene

  follow() {
    if (this.isShown && !this.dirty && !this.writing && this.edit.is.revision !== this.revision) this.read();
  }

  async read() {
    const { view } = this;
    if (this.reading) return;
    this.reading = true;
    try {
      const { text, file, revision } = await this.edit.ask("scene_text");
      if (this.dirty) return;
      this.revision = revision;
      this.parts.title.textContent = file?.split("/").pop() || "not saved yet";
      this.parts.title.title = file;
      this.filling = true;
      fillWith(view, text ?? "", Transaction.addToHistory.of(false)); // undo of the scene covers this change
      this.filling = false;
      this.say("");
    } catch (error) {
      this.say(error.message, true);
      return;
    } finally {
      this.reading = false;
    }
    if (this.edit.is.revision > this.revision) this.follow(); // the scene has changed during the request
  }

  // ---- to the scene

  change() {
    this.dirty = true;
    this.say("...");
    clearTimeout(this.later);
    this.later = setTimeout(() => this.write(), QUIET);
  }

  async write() {
    clearTimeout(this.later);
    if (!this.dirty || this.writing) return;
    const { text } = this;
    this.writing = true;
    try {
      const answer = await this.edit.ask("write_scene_text", { text, revision: this.revision });
      this.revision = answer.revision;
      this.dirty = text !== this.text;
      this.mark(null);
      this.say("done: the scene is as the text says");
      this.ask(null);
    } catch (error) {
      this.refused(error);
    } finally {
      this.writing = false;
    }
    if (this.dirty && text !== this.text) this.later = setTimeout(() => this.write(), QUIET);
  }

  refused(error) {
    this.say(error.message, true);
    this.mark(error);
    if (this.edit.is.revision === this.revision || error.line) return;
    const mine = ["Mine", () => this.keep(true)], theirs = ["The scene's", () => this.keep(false)];
    this.ask({ said: "The scene has been changed meanwhile. Which one stays? ", choices: [mine, theirs] });
  }

  async keep(isMine) {
    this.ask(null);
    const { revision } = await this.edit.ask("scene_text");
    this.revision = revision;
    if (isMine) return this.write();
    this.dirty = false;
    return this.read();
  }

  ask(question) {
    const { question: place } = this.parts;
    place.hidden = !question;
    if (question) place.replaceChildren(question.said, ...question.choices.map(([textContent, onclick]) => create("button", { type: "button", textContent, onclick })));
  }

  say(line, bad = false) {
    this.parts.said.textContent = line;
    this.parts.said.classList.toggle("bad", bad);
  }

  mark(error) {
    const { doc } = this.view.state;
    /** @type {import("@codemirror/lint").Diagnostic[]} */
    const diagnostics = [];
    if (error?.line) {
      const { from, to } = doc.line(Math.min(Math.max(1, error.line), doc.lines));
      diagnostics.push({ from, to, severity: "error", message: error.message });
    }
    this.view.dispatch(setDiagnostics(this.view.state, diagnostics));
  }
}
