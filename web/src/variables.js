// The variables of a script as a table, as they were at a breakpoint, or as they are; changed ones stand out.
import { pauseOf } from "./state/words.js";

const made = (tag, className, textContent = "") => Object.assign(document.createElement(tag), { className, textContent });

// Returns all variables in the order in which they are shown; `way` is such as self/pid/sum.
function flat(scopes) {
  const found = [];
  for (const [scope, rows] of scopes) {
    for (const [name, type, value, inside] of rows) {
      const way = `${scope}/${name}`;
      found.push({ way, scope, name, type, value, above: "", folds: inside.length > 0 });
      for (const [inner, kind, shown] of inside) found.push({ way: `${way}/${inner}`, scope, name: inner, type: kind, value: shown, above: way, folds: false });
    }
  }
  return found;
}

export class Variables {
  // `caption` says where and when, `body` gets the tables.
  constructor(caption, body) {
    this.caption = caption;
    this.body = body;
    this.open = new Set(); // ways of what is unfolded
    this.lines = new Map(); // the rows that are shown, by ways
    this.built = ""; // the ways for which they are
    this.before = new Map(); // values by ways, at the time before this one
    this.now = { time: null, values: new Map() };
    this.hint = caption.textContent;
    this.of = null; // whose values are shown, and when: { name, time }
  }

  // Shows what the simulation told; `file` is that of the script in the editor.
  take(state, file) {
    const { reached, scripts } = state;
    const script = scripts.find((one) => one.file === file) ?? scripts[0];
    const isAt = Boolean(reached.file);
    this.of = { name: (script?.file ?? "").split("/").pop(), time: state.time };
    const found = flat(isAt ? reached.scopes : script?.scopes ?? []);
    const ways = JSON.stringify(found.map(({ way, folds }) => [way, folds]));
    if (ways !== this.built) this.build(found); // else every row stays, and what is focused in it
    this.built = ways;
    if (state.time !== this.now.time) this.before = this.now.values;
    this.now = { time: state.time, values: new Map(found.map(({ way, value }) => [way, value])) };
    for (const one of found) this.fill(one);
  }

  clear() {
    this.of = null;
    this.built = "";
    this.lines.clear();
    this.body.replaceChildren();
  }

  // Says where the flight is paused, or whose values these are.
  say(now) {
    const words = this.words(pauseOf(now), now.status);
    if (this.caption.textContent !== words) this.caption.textContent = words;
  }

  words(pause, status) {
    if (pause) return `Paused at line ${pause.line} of ${pause.file.split("/").pop()}, t = ${pause.time.toFixed(2)} s`;
    if (!this.of) return this.hint;
    return this.of.name ? `${this.of.name}: ${status}, values of t = ${this.of.time.toFixed(2)} s` : "No script is loaded.";
  }

  build(found) {
    const tables = new Map();
    this.lines.clear();
    for (const one of found) {
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
      line.button = made("button", "unfold", "▸");
      line.button.setAttribute("aria-label", name);
      line.button.setAttribute("aria-expanded", "false");
      line.button.onclick = () => this.unfold(way, !this.open.has(way));
      key.append(line.button);
    }
    key.append(made("span", "", name));
    line.shown = line.insertCell();
    line.kind = made("small", "");
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
