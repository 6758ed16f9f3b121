// The panel of gains and other parameters. Changes are sent at once, one request at a time for each, and the latest value last.
import { at, create } from "./dom.js";
import { keep, kept } from "./storage.js";

const OPEN = ["Gains", "Script parameters"]; // groups that are open at first
const STEPS = 200; // positions of a slider
const WIDE = 20; // a slider covers a parameter's whole range if that is at most this many times `limit`

const format = (value) => (typeof value === "number" ? String(Number(value.toPrecision(7))) : value);

export class Tune {
  /**
   * @param {import("./board.js").Board} board
   * @param {wire.Ask} ask
   * @param {import("./notice.js").Notice} notice
   */
  constructor(board, ask, notice) {
    this.ask = ask;
    this.notice = notice;
    this.board = board;
    this.fields = new Map(); // functions that show a value, by parameter name
    this.waiting = new Map(); // the latest value of each parameter that is being set
    board.on("tuning", (groups) => this.build(groups));
    board.on("values", (values) => this.fill(values));
    at("tune-filter").oninput = () => this.filter();
  }

  build(groups) {
    const { id = "", value } = /** @type {HTMLInputElement} */ (document.activeElement ?? {}); // the focused field, and its text, are restored below
    this.fields.clear();
    const elements = groups.map(({ group, fields }) => this.group(group, fields));
    at("tune-groups").replaceChildren(...elements);
    this.fill(this.board.get("values", {}));
    this.filter();
    const field = id.startsWith("tune ") && at(/** @type {`tune ${string}`} */ (id));
    if (!field) return;
    if (field.type === "text") field.value = value;
    field.focus();
  }

  group(name, fields) {
    const group = create("details", {}, create("summary", { textContent: name, onclick: () => keep(`tune/${name}`, !group.open) }));
    group.dataset.name = name;
    if (!fields.length) group.append(create("p", { textContent: "The script that flies reads none of these." }));
    group.append(...fields.map((field) => this.field(field)));
    return group;
  }

  field(field) {
    const { name, kind, words, unit, hint } = field;
    const row = create("div", { className: "field", title: hint || name });
    row.dataset.name = `${name} ${hint}`.toLowerCase();
    const id = `tune ${name}`;
    const label = create("label", { htmlFor: id, textContent: name });
    if (unit) label.append(" ", create("small", { textContent: unit }));
    row.append(label);
    if (words.length) row.append(this.input(name, create("select", { id }, ...words.map((one) => new Option(one, one)))));
    else if (kind === "bool") row.append(this.input(name, create("input", { id, type: "checkbox" }), "checked"));
    else if (kind === "str") row.append(this.input(name, create("input", { id, type: "text" })));
    else this.number(row, field, id);
    return row;
  }

  /**
   * Adds a field, which takes any number, and a slider, whose range is narrow enough to choose a value by hand.
   * @param {HTMLElement} row
   * @param {wire.Field} field
   */
  number(row, { name, kind, low, high }, id) {
    const range = [low, high].map((end) => (end === null ? "" : format(end))).join(" to ");
    const text = create("input", { id, type: "text", inputMode: "decimal", autocomplete: "off", spellcheck: false });
    const slider = create("input", { type: "range", step: "any", "aria-label": `${name}, slider`, tabIndex: -1 });
    text.title = range.trim() === "to" ? name : `${name}: ${range}`;
    text.onchange = () => {
      const value = Number(text.value.trim().replace(",", "."));
      if (text.value.trim() === "" || Number.isNaN(value)) this.refuse(name, `${name} = ${text.value}: must be a number`);
      else this.set(name, value);
    };
    text.onkeydown = (event) => {
      if (event.key === "Escape") this.refuse(name, "");
    };
    slider.oninput = () => {
      const fine = (Number(slider.max) - Number(slider.min)) / STEPS;
      const rounded = Number((Math.round(slider.valueAsNumber / fine) * fine).toPrecision(6));
      text.value = format(kind === "int" ? Math.round(slider.valueAsNumber) : rounded);
      this.set(name, Number(text.value));
    };
    row.append(text, slider);
    this.fields.set(name, (value) => {
      if (document.activeElement !== text || !this.isWritten(text)) text.value = format(value);
      text.dataset.holds = format(value);
      if (document.activeElement === slider) return;
      const limit = Math.max(Math.abs(value) * 2, 1);
      const isNarrow = low !== null && high !== null && high - low <= WIDE * limit;
      slider.min = String(isNarrow ? low : Math.max(low ?? -limit, value < 0 ? -limit : 0));
      slider.max = String(isNarrow ? high : Math.min(high ?? limit, limit));
      slider.value = value;
    });
  }

  // Return whether the user is typing something other than the current value; that must not be overwritten.
  isWritten(text) {
    return text.value !== text.dataset.holds;
  }

  input(name, element, property = "value") {
    element.onchange = () => this.set(name, element[property]);
    this.fields.set(name, (value) => (element[property] = value));
    return element;
  }

  fill(values) {
    for (const [name, show] of this.fields) {
      if (name in values && !this.waiting.has(name)) show(values[name]);
    }
  }

  refuse(name, said) {
    this.notice.say(said, true);
    const current = this.board.get("values", {})[name];
    document.activeElement?.blur?.();
    if (current !== undefined) this.fields.get(name)?.(current);
  }

  async set(name, value) {
    const isSending = this.waiting.has(name);
    this.waiting.set(name, value);
    if (isSending) return; // the loop of that call sends this value next
    while (this.waiting.has(name)) {
      const sentValue = this.waiting.get(name);
      const done = await this.ask("tune", { name, value: sentValue }).then(
        ({ said }) => this.notice.say(said) ?? true,
        (error) => this.notice.say(error.message, true) ?? false,
      );
      if (this.waiting.get(name) !== sentValue) continue;
      this.waiting.delete(name);
      const current = this.board.get("values", {})[name];
      if (!done && current !== undefined) document.activeElement?.closest?.("#tune-panel") && document.activeElement.blur();
      if (current !== undefined) this.fields.get(name)?.(done ? sentValue : current);
    }
  }

  filter() {
    const query = at("tune-filter").value.trim().toLowerCase();
    for (const group of at("tune-groups").querySelectorAll("details")) {
      let hasMatch = !query;
      for (const row of group.querySelectorAll(".field")) {
        row.hidden = !row.dataset.name?.includes(query);
        hasMatch ||= !row.hidden;
      }
      group.hidden = !hasMatch;
      const { name = "" } = group.dataset;
      group.open = query ? hasMatch : kept(`tune/${name}`, OPEN.includes(name));
    }
  }
}
