// The code editor. It shows one script at a time, and keeps cursor, undo history and breakpoints of each. The browser
// stores the cursor and the first visible line.
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
const PLACES = "places"; // the storage key of cursors and first visible lines
const PLACED = 300; // ms without a move after which the cursor is stored
const MOST_PLACES = 100; // scripts whose cursors are stored
const FLOWN = "flight"; // the diagnostic source of runtime errors

export const colors = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword, tags.modifier], color: "var(--code-keyword)" },
  { tag: [tags.comment, tags.meta], color: "var(--code-comment)" },
  { tag: [tags.string, tags.special(tags.string)], color: "var(--code-string)" },
  { tag: [tags.number, tags.bool, tags.null], color: "var(--code-number)" },
  { tag: [tags.function(tags.variableName), tags.function(tags.propertyName), tags.function(tags.definition(tags.variableName))], color: "var(--code-function)" },
  { tag: [tags.className, tags.definition(tags.className)], color: "var(--code-class)" },
  { tag: tags.invalid, color: "var(--bad)" },
]);

// Replace the text in one change with `annotations`. Equal text at both ends stays, and so does the cursor in it.
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

// Select the whole number under the pointer, and return whether there is one. By default, a double click stops at its point.
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
  // `on` has the callbacks change(), run(), breakpoints(), check(text, isLua), which returns findings, checked(findings), and
  // moved(line) with the new line of a failure, 0 if the user has edited that line. `known` has the names for completion.
  constructor(parent, on, known) {
    this.states = new Map(); // the editor states of scripts that have been open, by name
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
    const run = { key: "Mod-Enter", run: () => (on.run(), true) }; // `true`, or the key would also insert a line
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

  // Show a script with `text` from the disk, at the cursor and the scroll position where the user left it.
  show(script, text) {
    this.leave();
    this.script = script;
    const known = this.states.get(script);
    this.view.setState(known?.state ?? this.begin(script, text));
    this.view.scrollDOM.scrollTo(0, 0); // otherwise the scroll position of the previous script would stay
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

  // Replace the text in one change that can be undone, without on.change(). Equal text stays, and so does the cursor in it.
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

  // ---- cursor and scroll position

  placeSoon() {
    clearTimeout(this.placing);
    this.placing = setTimeout(() => this.keepPlace(), PLACED);
  }

  // Store cursor and first visible line of the script in the browser.
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
    const effects = top ? EditorView.scrollIntoView(top, { y: "start", yMargin: 0 }) : []; // scrolling to line 1 would hide the margin above it
    this.view.dispatch({ selection, effects });
  }

  // ---- diagnostics

  get diagnostics() {
    const diagnostics = [];
    forEachDiagnostic(this.view.state, (one, from, to) => diagnostics.push({ ...one, from, to }));
    return diagnostics;
  }

  put(diagnostics) {
    this.view.dispatch(setDiagnostics(this.view.state, diagnostics));
  }

  // Report the new line of a failure after a change, 0 if the user has edited that line: it is not the line that failed.
  follow({ startState, state, changes }) {
    forEachDiagnostic(startState, (one, from, to) => {
      if (one.source !== FLOWN) return;
      const line = changes.touchesRange(from, to) ? 0 : state.doc.lineAt(changes.mapPos(from)).number;
      if (line !== startState.doc.lineAt(from).number) this.on.moved(line);
    });
  }

  // Mark the line of a failure and scroll to it; null removes the mark.
  mark(failure) {
    const { doc } = this.view.state;
    const diagnostics = this.diagnostics.filter((one) => one.source !== FLOWN);
    if (failure && failure.line >= 1 && failure.line <= doc.lines) {
      const { from, to } = doc.line(failure.line);
      diagnostics.push({ from, to, severity: "error", message: failure.said, source: FLOWN });
      this.view.dispatch({ effects: EditorView.scrollIntoView(from, { y: "center" }) });
    }
    this.put(diagnostics);
  }

  checkSoon() {
    clearTimeout(this.later);
    this.later = setTimeout(() => this.check(), QUIET);
  }

  // Check the text, underline the findings and return them. If the text has changed meanwhile, a later check underlines them.
  async check() {
    clearTimeout(this.later);
    const { script, text } = this;
    if (!script) return [];
    const findings = await this.on.check(text, isLua(script)).catch(() => null);
    if (!findings || script !== this.script || text !== this.text) return findings ?? [];
    const flown = this.diagnostics.filter((one) => one.source === FLOWN);
    this.put([...flown, ...findings.map((one) => this.placed(one))]);
    this.on.checked(findings);
    return findings;
  }

  placed({ line, column, end, said, severity }) {
    const { doc } = this.view.state;
    const whole = doc.line(Math.min(Math.max(1, line), doc.lines));
    const from = Math.min(whole.from + column - 1, whole.to);
    const to = end ? Math.min(whole.from + end - 1, whole.to) : whole.to;
    return { from: from === to ? Math.max(whole.from, from - 1) : from, to, severity, message: said };
  }

  // ---- breakpoints

  // The lines with breakpoints, by script; scripts without breakpoints are left out.
  get breakpoints() {
    const states = [...this.states].filter(([script]) => script !== this.script).map(([script, { state }]) => [script, linesOf(state)]);
    if (this.script) states.push([this.script, linesOf(this.view.state)]);
    return Object.fromEntries(states.filter(([, lines]) => lines.length));
  }

  // Mark the line at which the script is paused; 0 removes the mark.
  paused(line) {
    showPaused(this.view, line);
  }
}
