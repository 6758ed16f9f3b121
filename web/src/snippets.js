// Insertion of a lesson's code into the script: a function replaces the one of the same name, other lines go to the cursor.
import { pythonLanguage } from "@codemirror/lang-python";
import { EditorView } from "@codemirror/view";

const MARGIN = 4; // spaces of an indentation level

// Return the top-level functions of a Python text: { name, from, to }.
function functionsOf(text) {
  const definitions = [];
  for (let node = pythonLanguage.parser.parse(text).topNode.firstChild; node; node = node.nextSibling) {
    const name = node.name === "FunctionDefinition" && node.getChild("VariableName");
    if (name) definitions.push({ name: text.slice(name.from, name.to), from: node.from, to: node.from + text.slice(node.from, node.to).trimEnd().length });
  }
  return definitions;
}

const marginOf = (line) => line.length - line.trimStart().length;

function dedent(code) {
  const lines = code.trimEnd().split("\n");
  const margin = Math.min(...lines.filter((line) => line.trim()).map(marginOf));
  return lines.map((line) => line.slice(margin));
}

export const hasFunctions = (code) => functionsOf(code).length > 0;

// Return where a text has these lines, at any indentation: { from, to }, null if it does not have them.
function findLines(text, lines) {
  const all = text.split("\n");
  for (let first = 0; first + lines.length <= all.length; first++) {
    const margin = " ".repeat(marginOf(all[first]));
    if (!lines.every((line, index) => all[first + index] === (line && margin + line))) continue;
    const from = all.slice(0, first).join("\n").length + (first ? 1 : 0);
    return { from, to: from + all.slice(first, first + lines.length).join("\n").length };
  }
  return null;
}

// Return the indentation for lines inserted at `line`: that of the line, or, if it is empty, what the code above calls for.
function marginAt(doc, line) {
  for (let number = line.number; number >= 1; number--) {
    const { text } = doc.line(number);
    if (text.trim()) return marginOf(text) + (number < line.number && text.trimEnd().endsWith(":") ? MARGIN : 0);
  }
  return 0;
}

// Return the changes that put functions into a text: each replaces the one of the same name, new ones go to the end.
function functionChanges(text, code) {
  const present = functionsOf(text);
  const changes = [];
  let added = "";
  for (const { name, from, to } of functionsOf(code)) {
    const before = present.find((one) => one.name === name);
    const insert = code.slice(from, to);
    if (before) changes.push({ from: before.from, to: before.to, insert });
    else added += `\n\n\n${insert}`;
  }
  if (added) changes.push({ from: text.trimEnd().length, to: text.length, insert: `${added}\n` });
  return changes;
}

function lineChange(doc, at, lines) {
  const line = doc.lineAt(at);
  const margin = " ".repeat(marginAt(doc, line));
  const insert = lines.map((one) => one && margin + one).join("\n");
  return line.text.trim() ? { from: line.from, insert: `${insert}\n` } : { from: line.from, to: line.to, insert };
}

// Put code into the editor's script unless it is there already, and select it. Return a message for the user.
export function putInto(view, script, code) {
  if (!script.endsWith(".py")) throw new Error(`these lines are Python, ${script} is not`);
  const { doc, selection } = view.state;
  const lines = dedent(code);
  const present = findLines(doc.toString(), lines);
  if (present) {
    view.dispatch({ selection: { anchor: present.from, head: present.to }, effects: EditorView.scrollIntoView(present.from, { y: "center" }) });
    return `these lines are in the script: line ${doc.lineAt(present.from).number}`;
  }
  const text = lines.join("\n");
  const changes = hasFunctions(text) ? functionChanges(doc.toString(), text) : lineChange(doc, selection.main.head, lines);
  view.dispatch({ changes, userEvent: "input.paste" });
  const now = view.state.doc;
  const inserted = findLines(now.toString(), lines) ?? functionsOf(now.toString()).find((one) => functionsOf(text).some(({ name }) => name === one.name));
  if (!inserted) return "put into the script";
  view.dispatch({ selection: { anchor: inserted.from, head: inserted.to }, effects: EditorView.scrollIntoView(inserted.from, { y: "center" }) });
  return `put into the script: line ${now.lineAt(inserted.from).number}`;
}
