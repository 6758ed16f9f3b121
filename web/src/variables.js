// The table of a script's variables, at a breakpoint or live. Changed values are highlighted.
import { pauseOf } from "./state/words.js";

const createElement = (tag, className, textContent = "") => Object.assign(document.createElement(tag), { className, textContent });

// Return all variables in display order. `way` is the path of a variable, such as self/pid/sum.
function flat(scopes) {
  const variables = [];
  for (const [scope, rows] of scopes) {
    for (const [name, type, value, inside] of rows) {
      const way = `${scope}/${name}`;
      variables.push({ way, scope, name, type, value, above: "", folds: inside.length > 0 });
      for (const [inner, kind, shown] of inside) variables.push({ way: `${way}/${inner}`, scope, name: inner, type: kind, value: shown, above: way, folds: false });
    }
  }
  return variables;
}

export class Variables {
  // `caption` shows script and time of the values, `body` gets the tables.
  constructor(caption, body) {
    this.caption = caption;
    this.body = body;
    this.open = new Set(); // paths of the unfolded variables
    this.lines = new Map(); // the rows of the tables, by path
    this.built = ""; // the paths of these rows, as JSON
    this.before = new Map(); // values by path, at the time before this one
    this.now = { time: null, values: new Map() };
    this.hint = caption.textContent;
    this.of = null; // script and time of the values: { name, time (s) }
  }

  // Show the variables that the simulation sent; `file` is the file of the open script.
  take(state, file) {
    const { reached, scripts } = state;
    const script = scripts.find((one) => one.file === file) ?? scripts[0];
    const isAt = Boolean(reached.file);
    this.of = { name: (script?.file ?? "").split("/").pop(), time: state.time };
    const variables = flat(isAt ? reached.scopes : script?.scopes ?? []);
    const ways = JSON.stringify(variables.map(({ way, folds }) => [way, folds]));
    if (ways !== this.built) this.build(variables); // otherwise all rows stay, and the focus in them
    this.built = ways;
    if (state.time !== this.now.time) this.before = this.now.values;
    this.now = { time: state.time, values: new Map(variables.map(({ way, value }) => [way, value])) };
    for (const one of variables) this.fill(one);
  }

  clear() {
    this.of = null;
    this.built = "";
    this.lines.clear();
    this.body.replaceChildren();
  }

  // Show in the caption where the flight is paused, or whose values these are.
  say(now) {
    const words = this.words(pauseOf(now), now.status);
    if (this.caption.textContent !== words) this.caption.textContent = words;
  }

  words(pause, status) {
    if (pause) return `Paused at line ${pause.line} of ${pause.file.split("/").pop()}, t = ${pause.time.toFixed(2)} s`;
    if (!this.of) return this.hint;
    return this.of.name ? `${this.of.name}: ${status}, values of t = ${this.of.time.toFixed(2)} s` : "No script is loaded.";
  }

  build(variables) {
    const tables = new Map();
    this.lines.clear();
    for (const one of variables) {
      if (!tables.has(one.scope)) {
        tables.set(one.scope, document.createElement("table"));
        tables.get(one.scope).createCaption().textContent = one.scope;
      }
      this.lines.set(one.way, this.line(tables.get(one.scope), one));
    }
    this.body.replaceChildren(...tables.values());
    for (const way of this.open) this.unfold(way, true);
  }

  line(table, { way, name, above, folds }) {
    const line = table.insertRow();
    const key = document.createElement("th");
    key.scope = "row";
    line.append(key);
    line.hidden = above !== "";
    line.above = above;
    if (folds) {
      line.button = createElement("button", "unfold", "▸");
      line.button.setAttribute("aria-label", name);
      line.button.setAttribute("aria-expanded", "false");
      line.button.onclick = () => this.unfold(way, !this.open.has(way));
      key.append(line.button);
    }
    key.append(createElement("span", "", name));
    line.shown = line.insertCell();
    line.kind = createElement("small", "");
    line.insertCell().append(line.kind);
    return line;
  }

  fill({ way, type, value, above }) {
    const line = this.lines.get(way);
    const isChanged = this.before.has(way) && this.before.get(way) !== value;
    line.className = [isChanged && "changed", above && "inner"].filter(Boolean).join(" ");
    if (line.shown.textContent !== value) Object.assign(line.shown, { textContent: value, title: value });
    if (line.kind.textContent !== type) line.kind.textContent = type;
  }

  unfold(way, on) {
    this.open[on ? "add" : "delete"](way);
    const button = this.lines.get(way)?.button;
    if (!button) return;
    button.textContent = on ? "▾" : "▸";
    button.setAttribute("aria-expanded", String(on));
    for (const line of this.lines.values()) if (line.above === way) line.hidden = !on;
  }
}
