// The text of one script at a time; each keeps its own cursor, its own history of changes, and its breakpoints. The
// browser remembers the cursor and what was in sight.
import { basicSetup } from "codemirror";
import { indentWithTab } from "@codemirror/commands";
import { EditorState, Prec } from "@codemirror/state";
import { EditorView, keymap } from "@codemirror/view";
import { HighlightStyle, StreamLanguage, indentUnit, syntaxHighlighting } from "@codemirror/language";
import { forEachDiagnostic, setDiagnostics } from "@codemirror/lint";
import { python } from "@codemirror/lang-python";
import { lua } from "@codemirror/legacy-modes/mode/lua";
import { tags } from "@lezer/highlight";
import { breakpointGutter, linesOf, showPaused } from "./breakpoints.js";
import { completion } from "./completion.js";
import { numberAt } from "./numbers.js";
import { keep, kept } from "./storage.js";

const QUIET = 500; // ms without a key before the text is checked
const PLACES = "places"; // the key of cursors and first visible lines
const PLACED = 300; // ms without a move after which the cursor is remembered
const MOST_PLACES = 100; // scripts whose cursors are remembered
const FLOWN = "flight"; // the source of a failure while it flew

export const colors = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword, tags.modifier], color: "var(--code-keyword)" },
  { tag: [tags.comment, tags.meta], color: "var(--code-comment)" },
  { tag: [tags.string, tags.special(tags.string)], color: "var(--code-string)" },
  { tag: [tags.number, tags.bool, tags.null], color: "var(--code-number)" },
  { tag: [tags.function(tags.variableName), tags.function(tags.propertyName), tags.function(tags.definition(tags.variableName))], color: "var(--code-function)" },
  { tag: [tags.className, tags.definition(tags.className)], color: "var(--code-class)" },
  { tag: tags.invalid, color: "var(--bad)" },
]);

// Puts another text there, as one change; what is the same stays, and the cursor with it. `annotations` are the change's.
/**
 * @param {EditorView} view
 * @param {string} text
 * @param {import("@codemirror/state").TransactionSpec["annotations"]} [annotations]
 */
export function fillWith(view, text, annotations) {
  const before = view.state.doc.toString();
  const most = Math.min(text.length, before.length);
  let from = 0;
  while (from < most && text[from] === before[from]) from++;
  let end = 0;
  while (end < most - from && text[text.length - 1 - end] === before[before.length - 1 - end]) end++;
  view.dispatch({ changes: { from, to: before.length - end, insert: text.slice(from, text.length - end) }, annotations });
}

// Selects the number under the pointer as a whole; a double click selects words otherwise, which end at a point.
function selectNumber(view, event) {
  const position = view.posAtCoords({ x: event.clientX, y: event.clientY });
  if (position === null) return false;
  const { from, text } = view.state.doc.lineAt(position);
  const number = numberAt(text, position - from);
  if (number) view.dispatch({ selection: { anchor: from + number.from, head: from + number.to } });
  return Boolean(number);
}

export const isLua = (script) => script.endsWith(".lua");

export class Editor {
  // `on` has change(), run(), check(text, isLua), which answers with findings, checked(findings), moved(line), which hears
  // where the line of a failure is now, 0 if it was written anew, and breakpoints(); `known` is the API.
  constructor(parent, on, known) {
    this.states = new Map(); // of scripts that have been open, by name
    this.script = "";
    this.on = on;
    this.known = known;
    const changed = EditorView.updateListener.of((update) => {
      if (update.docChanged || update.selectionSet) this.placeSoon();
      if (!update.docChanged) return;
      this.checkSoon();
      this.follow(update);
      if (!this.filling) on.change();
    });
    const run = { key: "Mod-Enter", run: () => (on.run(), true) }; // else it would begin a line, too
    this.common = [
      Prec.highest(keymap.of([run])),
      breakpointGutter(() => on.breakpoints()),
      syntaxHighlighting(colors),
      basicSetup,
      keymap.of([indentWithTab]),
      indentUnit.of("    "),
      EditorView.domEventHandlers({ dblclick: (event, view) => selectNumber(view, event) }),
      EditorView.contentAttributes.of({ tabindex: "0", "aria-label": "Text of the child script; Escape and then Tab leaves it" }),
      changed,
    ];
    this.view = new EditorView({ parent, state: this.begin("", "") });
    this.view.scrollDOM.addEventListener("scroll", () => this.placeSoon());
    window.addEventListener("pagehide", () => this.keepPlace());
  }

  begin(script, text) {
    const language = isLua(script) ? StreamLanguage.define(lua) : python();
    return EditorState.create({ doc: text, extensions: [this.common, language, completion(this.known, isLua(script))] });
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
    this.view.scrollDOM.scrollTo(0, 0); // else it would stay where the script before was scrolled to
    this.fill(text);
    if (known) this.view.dispatch({ effects: known.scroll });
    else this.restorePlace();
    this.check();
    this.on.breakpoints();
  }

  leave() {
    this.keepPlace();
    if (this.script) this.states.set(this.script, { state: this.view.state, scroll: this.view.scrollSnapshot() });
  }

  rename(script) {
    this.states.delete(this.script);
    this.script = script;
    this.keepPlace();
    this.on.breakpoints();
  }

  forget(script) {
    this.states.delete(script);
    if (this.script === script) this.script = "";
  }

  // Puts another text there, as one change that can be undone; what is the same stays, and the cursor with it.
  fill(text) {
    if (text === this.text) return;
    this.filling = true;
    fillWith(this.view, text);
    this.filling = false;
  }

  goTo(line) {
    const { doc } = this.view.state;
    const { from } = doc.line(Math.min(Math.max(1, line), doc.lines));
    this.view.dispatch({ selection: { anchor: from }, effects: EditorView.scrollIntoView(from, { y: "center" }) });
    this.view.focus();
  }

  // ---- where one was

  placeSoon() {
    clearTimeout(this.placing);
    this.placing = setTimeout(() => this.keepPlace(), PLACED);
  }

  // Remembers cursor and first visible line of the script.
  keepPlace() {
    clearTimeout(this.placing);
    if (!this.script) return;
    const { anchor, head } = this.view.state.selection.main;
    const block = this.view.lineBlockAtHeight(this.view.scrollDOM.scrollTop);
    const top = this.view.state.doc.lineAt(block.from).number;
    const { [this.script]: _, ...others } = kept(PLACES, {});
    const places = [...Object.entries(others), [this.script, { anchor, head, top }]].slice(-MOST_PLACES);
    keep(PLACES, Object.fromEntries(places));
  }

  restorePlace() {
    const place = kept(PLACES, {})[this.script];
    if (!place) return;
    const { doc } = this.view.state;
    const within = (position) => Math.min(Math.max(0, position), doc.length);
    const top = doc.line(Math.min(Math.max(1, place.top), doc.lines)).from;
    const selection = { anchor: within(place.anchor), head: within(place.head) };
    const effects = top ? EditorView.scrollIntoView(top, { y: "start", yMargin: 0 }) : []; // above the first line is a margin
    this.view.dispatch({ selection, effects });
  }

  // ---- what is wrong

  get diagnostics() {
    const found = [];
    forEachDiagnostic(this.view.state, (one, from, to) => found.push({ ...one, from, to }));
    return found;
  }

  put(diagnostics) {
    this.view.dispatch(setDiagnostics(this.view.state, diagnostics));
  }

  // Tells where the line of a failure is after a change; a line that was written anew has not failed.
  follow({ startState, state, changes }) {
    forEachDiagnostic(startState, (one, from, to) => {
      if (one.source !== FLOWN) return;
      const line = changes.touchesRange(from, to) ? 0 : state.doc.lineAt(changes.mapPos(from)).number;
      if (line !== startState.doc.lineAt(from).number) this.on.moved(line);
    });
  }

  // Shows a failure at its line, or none.
  mark(failure) {
    const { doc } = this.view.state;
    const found = this.diagnostics.filter((one) => one.source !== FLOWN);
    if (failure && failure.line >= 1 && failure.line <= doc.lines) {
      const { from, to } = doc.line(failure.line);
      found.push({ from, to, severity: "error", message: failure.said, source: FLOWN });
      this.view.dispatch({ effects: EditorView.scrollIntoView(from, { y: "center" }) });
    }
    this.put(found);
  }

  checkSoon() {
    clearTimeout(this.later);
    this.later = setTimeout(() => this.check(), QUIET);
  }

  // Underlines what is wrong with the text; returns that. What was written meanwhile is checked later.
  async check() {
    clearTimeout(this.later);
    const { script, text } = this;
    if (!script) return [];
    const found = await this.on.check(text, isLua(script)).catch(() => null);
    if (!found || script !== this.script || text !== this.text) return found ?? [];
    const flown = this.diagnostics.filter((one) => one.source === FLOWN);
    this.put([...flown, ...found.map((one) => this.placed(one))]);
    this.on.checked(found);
    return found;
  }

  placed({ line, column, end, said, severity }) {
    const { doc } = this.view.state;
    const whole = doc.line(Math.min(Math.max(1, line), doc.lines));
    const from = Math.min(whole.from + column - 1, whole.to);
    const to = end ? Math.min(whole.from + end - 1, whole.to) : whole.to;
    return { from: from === to ? Math.max(whole.from, from - 1) : from, to, severity, message: said };
  }

  // ---- breakpoints

  // The lines of all scripts that have any.
  get breakpoints() {
    const states = [...this.states].filter(([script]) => script !== this.script).map(([script, { state }]) => [script, linesOf(state)]);
    if (this.script) states.push([this.script, linesOf(this.view.state)]);
    return Object.fromEntries(states.filter(([, lines]) => lines.length));
  }

  // Shows where it is paused, 0 for nowhere.
  paused(line) {
    showPaused(this.view, line);
  }
}
