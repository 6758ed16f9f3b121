// Lines of a text, put into the script in the editor: a function in the place of its namesake, others at the cursor.
import { pythonLanguage } from "@codemirror/lang-python";
import { EditorView } from "@codemirror/view";

const MARGIN = 4; // of a function's lines

// The functions that stand at the beginning of a line: { name, from, to }.
function functions(text) {
  const found = [];
  for (let node = pythonLanguage.parser.parse(text).topNode.firstChild; node; node = node.nextSibling) {
    const name = node.name === "FunctionDefinition" && node.getChild("VariableName");
    if (name) found.push({ name: text.slice(name.from, name.to), from: node.from, to: node.from + text.slice(node.from, node.to).trimEnd().length });
  }
  return found;
}

const marginOf = (line) => line.length - line.trimStart().length;

function dedented(code) {
  const lines = code.trimEnd().split("\n");
  const margin = Math.min(...lines.filter((line) => line.trim()).map(marginOf));
  return lines.map((line) => line.slice(margin));
}

export const hasFunctions = (code) => functions(code).length > 0;

// Where these lines stand in a text, however far to the right: { from, to }, null for nowhere.
function standing(text, lines) {
  const all = text.split("\n");
  for (let first = 0; first + lines.length <= all.length; first++) {
    const margin = " ".repeat(marginOf(all[first]));
    if (!lines.every((line, index) => all[first + index] === (line && margin + line))) continue;
    const from = all.slice(0, first).join("\n").length + (first ? 1 : 0);
    return { from, to: from + all.slice(first, first + lines.length).join("\n").length };
  }
  return null;
}

// The margin of lines that come before a line: its own, or that of what it would go on with.
function marginAt(doc, line) {
  for (let number = line.number; number >= 1; number--) {
    const { text } = doc.line(number);
    if (text.trim()) return marginOf(text) + (number < line.number && text.trimEnd().endsWith(":") ? MARGIN : 0);
  }
  return 0;
}

// The changes that put functions into a text: each in the place of its namesake, new ones at the end.
function placedFunctions(text, code) {
  const there = functions(text);
  const changes = [];
  let added = "";
  for (const { name, from, to } of functions(code)) {
    const before = there.find((one) => one.name === name);
    const insert = code.slice(from, to);
    if (before) changes.push({ from: before.from, to: before.to, insert });
    else added += `\n\n\n${insert}`;
  }
  if (added) changes.push({ from: text.trimEnd().length, to: text.length, insert: `${added}\n` });
  return changes;
}

function placedLines(doc, at, lines) {
  const line = doc.lineAt(at);
  const margin = " ".repeat(marginAt(doc, line));
  const insert = lines.map((one) => one && margin + one).join("\n");
  return line.text.trim() ? { from: line.from, insert: `${insert}\n` } : { from: line.from, to: line.to, insert };
}

// Puts lines into the editor's script, and shows them there; returns what there is to say of it.
export function putInto(view, script, code) {
  if (!script.endsWith(".py")) throw new Error(`these lines are Python, ${script} is not`);
  const { doc, selection } = view.state;
  const lines = dedented(code);
  const found = standing(doc.toString(), lines);
  if (found) {
    view.dispatch({ selection: { anchor: found.from, head: found.to }, effects: EditorView.scrollIntoView(found.from, { y: "center" }) });
    return `these lines are in the script: line ${doc.lineAt(found.from).number}`;
  }
  const text = lines.join("\n");
  const changes = hasFunctions(text) ? placedFunctions(doc.toString(), text) : placedLines(doc, selection.main.head, lines);
  view.dispatch({ changes, userEvent: "input.paste" });
  const now = view.state.doc;
  const put = standing(now.toString(), lines) ?? functions(now.toString()).find((one) => functions(text).some(({ name }) => name === one.name));
  if (!put) return "put into the script";
  view.dispatch({ selection: { anchor: put.from, head: put.to }, effects: EditorView.scrollIntoView(put.from, { y: "center" }) });
  return `put into the script: line ${now.lineAt(put.from).number}`;
}
