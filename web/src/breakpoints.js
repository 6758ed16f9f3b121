// The editor's breakpoints, toggled by F9 or by a click beside a line. They move with their lines when the text changes.
import { EditorView, Decoration, GutterMarker, gutter, keymap, lineNumbers } from "@codemirror/view";
import { RangeSet, StateEffect, StateField } from "@codemirror/state";

// A line without a breakpoint: empty, a comment, a decorator, a docstring, the head of a definition, else, try, finally or end.
const NOTHING = /^\s*(?:(?:#|--|@|(?:async\s+)?def\b|class\b|(?:local\s+)?function\b|"""|''').*|end|else:?|try:|finally:)?\s*$/;

/** @type {import("@codemirror/state").StateEffectType<number>} the position of a line's first character */
const toggled = StateEffect.define({ map: (at, changes) => changes.mapPos(at) });
/** @type {import("@codemirror/state").StateEffectType<number>} a line number, 0 for none */
const pausedAt = StateEffect.define();

class Marker extends GutterMarker {
  toDOM() {
    const dot = document.createElement("span");
    dot.title = "Breakpoint (F9)";
    return dot;
  }
}
const marker = new Marker();
marker.elementClass = "cm-breakpoint";
const spacer = new Marker(); // reserves the gutter's width

const breakpoints = StateField.define({
  create: () => RangeSet.empty,
  update(set, transaction) {
    set = set.map(transaction.changes);
    for (const { value: at } of transaction.effects.filter((one) => one.is(toggled))) {
      let isSet = false;
      set.between(at, at, (from) => void (isSet = from === at));
      set = isSet ? set.update({ filter: (from) => from !== at }) : set.update({ add: [marker.range(at)], sort: true });
    }
    return transaction.docChanged ? onLines(set, transaction.state.doc) : set;
  },
});

// Return the breakpoints moved to the beginnings of their lines, at most one for each line.
function onLines(set, doc) {
  const starts = new Set();
  for (let at = set.iter(); at.value; at.next()) starts.add(doc.lineAt(at.from).from);
  return RangeSet.of([...starts].sort((a, b) => a - b).map((at) => marker.range(at)));
}

const paused = StateField.define({
  create: () => Decoration.none,
  update(set, transaction) {
    set = set.map(transaction.changes);
    for (const { value: line } of transaction.effects.filter((one) => one.is(pausedAt))) {
      const { doc } = transaction.state;
      const exists = line >= 1 && line <= doc.lines;
      set = exists ? Decoration.set([Decoration.line({ class: "cm-paused" }).range(doc.line(line).from)]) : Decoration.none;
    }
    return set;
  },
  provide: (field) => EditorView.decorations.from(field),
});

// Return the start of line `number`, or of the next line that can be reached, for a breakpoint.
function lineFrom(doc, number) {
  let line = doc.line(number);
  while (NOTHING.test(line.text) && line.number < doc.lines) line = doc.line(line.number + 1);
  return line.from;
}

function toggle(view, at) {
  const { doc } = view.state;
  const { number, from } = doc.lineAt(at);
  const isSet = linesOf(view.state).includes(number);
  view.dispatch({ effects: toggled.of(isSet ? from : lineFrom(doc, number)) });
  return true;
}

export function linesOf(state) {
  const lines = [];
  const set = state.field(breakpoints, false);
  for (let at = set?.iter(); at?.value; at.next()) lines.push(state.doc.lineAt(at.from).number);
  return lines;
}

export const showPaused = (view, line) => view.dispatch({ effects: pausedAt.of(line) });

// Return the editor extensions for breakpoints; `onChange()` is called when the set of breakpoints changes.
export function breakpointGutter(onChange) {
  const click = { mousedown: (view, line, event) => event.button === 0 && toggle(view, line.from) };
  return [
    breakpoints,
    paused,
    gutter({ class: "cm-breakpoints", markers: (view) => view.state.field(breakpoints), domEventHandlers: click, initialSpacer: () => spacer }),
    lineNumbers({ domEventHandlers: click }),
    keymap.of([{ key: "F9", run: (view) => toggle(view, view.state.selection.main.head) }]),
    EditorView.updateListener.of(({ startState, state }) => {
      if (startState.field(breakpoints, false) !== state.field(breakpoints)) onChange();
    }),
  ];
}
