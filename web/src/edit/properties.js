// Properties panel: a field for each key that a scene file has for the selected objects' type, by the kind of its value.
import { create } from "../dom.js";
import { numberField } from "./number_field.js";
import { volumeOf } from "./volumes.js";

// Keys that are changed most come first, all others in the node's order.
const FIRST = ["size", "color", "texture", "mass", "static", "respondable", "visible", "friction", "restitution", "script", "width", "height", "fov", "horizontal_fov", "near", "far", "every", "rate", "min_range", "max_range"];
const FINE = { size: 0.1, mass: 0.1 }; // steps of the arrow keys, by key
const STEP = 0.1, TURN = 15; // steps of other keys; of angles in degrees
const WHITE = [1, 1, 1, 1];
const DEGREE = Math.PI / 180; // rad

// Groups of keys; the most used keys are in none. All keys of vehicles but OF_VEHICLES are advanced, and all of cameras but `camera`.
const GROUPS = {
  look: ["color", "texture", "visible"],
  physics: ["mass", "static", "respondable", "friction", "restitution"],
  camera: ["width", "height", "fov", "horizontal_fov", "near", "far", "every", "baseline", "lens", "size"],
  advanced: ["category", "size_factor", "inertia", "suffix"],
};
const OF_CAMERAS = ["vision_sensor", "vehicle_camera"];
const OF_VEHICLES = ["script", "start"];
// Labels of keys that are not clear by themselves, mostly as in V-REP's dialogs.
const NAMES = {
  fov: "perspective angle", horizontal_fov: "horizontal angle", near: "near clipping plane", far: "far clipping plane",
  every: "a picture every", urdf: "body, a URDF file", cmd_vel_timeout: "commands time out after", objects: "V-REP's objects",
};
const JOINTS = { revolute: { place: "rad", speed: "rad/s", force: "N m" }, prismatic: { place: "m", speed: "m/s", force: "N" } };
// Names of the numbers of a size.
const PARTS = { box: ["length", "width", "height"], cylinder: ["radius", "length"], capsule: ["radius", "length"], sphere: ["radius"], mesh: ["scale along x", "y", "z"] };

const labelOf = (key) => NAMES[key] ?? key.replaceAll(/[_.]/g, " ");
const innerLabelOf = (key) => labelOf(key.slice(key.lastIndexOf(".") + 1));
function groupOf(key, type) {
  if (key.includes(".")) return labelOf(key.slice(0, key.lastIndexOf(".")).replaceAll(".", ": "));
  if (type === "vehicle") return OF_VEHICLES.includes(key) ? "" : "advanced";
  if (OF_CAMERAS.includes(type)) return GROUPS.camera.includes(key) ? "camera" : "advanced";
  const [group = ""] = Object.entries(GROUPS).find(([name, keys]) => name !== "camera" && keys.includes(key)) ?? [];
  return group;
}
const MOST_SHOWN = 1e9; // larger limits are not shown: nobody reaches them
const hexOf = (color) => `#${color.slice(0, 3).map((one) => Math.round(255 * one).toString(16).padStart(2, "0")).join("")}`;
const rgbOf = (text) => [1, 3, 5].map((from) => Number((parseInt(text.slice(from, from + 2), 16) / 255).toFixed(3)));
const isPlain = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

export class Properties {
  // `openText()` shows the scene's text, for values that have no field.
  /**
   * @param {HTMLElement} element
   * @param {import("./edit.js").Edit} edit
   * @param {() => void} openText
   */
  constructor(element, edit, openText) {
    this.element = element;
    this.edit = edit;
    this.openText = openText;
    /** @type {Record<string, wire.Property[]> | null} */
    this.types = null; // the keys of each type, once the node has sent them
    this.built = ""; // what the fields were built for, as JSON
    /** @type {((one: import("./objects.js").SceneObject) => void)[]} */
    this.fills = []; // each shows a field's current value
    edit.on("mode", () => this.ask());
    edit.on("selection", () => this.show());
    edit.on("objects", () => this.show());
  }

  ask() {
    if (!this.edit.isOn || this.types) return;
    this.edit.ask("properties").then(({ types }) => {
      this.types = types;
      this.show();
    }, (error) => this.edit.wrong(error.message));
  }

  get ones() {
    return this.edit.selected.flatMap((one) => this.edit.objects.get(one) ?? []);
  }

  // Return the keys that all selected objects have.
  keys() {
    const lists = this.ones.map(({ type }) => this.types?.[type] ?? []);
    const [first = [], ...others] = lists.reverse();
    const common = first.filter(({ key, kind }) => others.every((list) => list.some((one) => one.key === key && one.kind === kind)));
    const rank = ({ key }) => (FIRST.includes(key) ? FIRST.indexOf(key) : FIRST.length);
    return common.sort((one, other) => rank(one) - rank(other));
  }

  show() {
    const { ones } = this;
    const one = ones.at(-1);
    const inside = one && Object.keys(one.values.script_parameters ?? {});
    const wanted = JSON.stringify([ones.map(({ handle, type, script, values }) => [handle, type, Boolean(script), type === "joint" && [values.type, values.mode]]), inside, Boolean(this.types)]);
    if (wanted !== this.built) this.build(one);
    this.built = wanted;
    if (one) for (const fill of this.fills) fill(one);
  }

  build(one) {
    this.fills = [];
    const hasNoProperties = this.ones.some(({ of, root, values }) => of === "vehicle" && !root && !Object.keys(values).length);
    const keys = one && !hasNoProperties ? this.keys() : [];
    const rows = this.grouped(keys, one);
    if (one && this.ones.length === 1) rows.unshift(...this.names(one));
    if (one?.script && this.ones.length === 1) rows.push(this.parameters(one));
    if (hasNoProperties) rows.push(create("p", { textContent: "A part of a vehicle: it has no properties of its own." }));
    this.element.replaceChildren(...rows.filter(Boolean));
    this.element.parentElement?.scrollTo(0, 0);
  }

  // Return the rows. Look, physics and camera are open; other groups only if a key differs from its default, advanced never.
  /**
   * @param {wire.Property[]} keys
   * @param {Partial<import("./objects.js").SceneObject>} [one]
   */
  grouped(keys, { values = {}, type } = {}) {
    const rows = [];
    const groups = new Map();
    const begin = (name) => create("details", { open: name !== "advanced" && name in GROUPS }, create("summary", { textContent: name }));
    for (const name of Object.keys(GROUPS)) if (keys.some(({ key }) => groupOf(key, type) === name)) groups.set(name, begin(name));
    for (const property of keys) {
      const name = groupOf(property.key, type);
      if (name && !groups.has(name)) groups.set(name, begin(name));
      const group = groups.get(name);
      if (!group) rows.push(this.row(property));
      else group.append(...[this.row(property), property.key === "mass" && this.density()].filter(Boolean));
      if (group && name !== "advanced" && !same(values[property.key] ?? property.default, property.default)) group.open = true;
    }
    return [...rows, ...groups.values()];
  }

  line(key, hint, ...parts) {
    const row = create("div", { className: "field", title: hint }, create("span", { textContent: innerLabelOf(key) }), ...parts);
    row.dataset.key = key;
    return row;
  }

  set(key, value, merge) {
    return this.edit.set(this.edit.selected, { [key]: value }, merge);
  }

  // The callbacks that all number fields share.
  get answers() {
    return { wrong: (line) => this.edit.wrong(line), undo: (merge) => this.edit.undo("undo", merge) };
  }

  // Call `fill` with the value of `key`, `fallback` if it has none, at each update of the panel.
  follow(key, fallback, fill) {
    this.fills.push((one) => fill(one.values[key] ?? fallback));
  }

  names(one) {
    if (!this.edit.mayRename(one)) return [];
    const field = (label, now, take, hint) => {
      const input = create("input", { type: "text", "aria-label": label, value: now(one), maxLength: 100, spellcheck: false });
      input.onchange = () => (input.value.trim() ? take(input.value.trim()) : (input.value = now(one)));
      this.fills.push((other) => document.activeElement === input || (input.value = now(other)));
      return this.line(label, hint, input);
    };
    const here = () => this.edit.objects.get(one.handle) ?? one;
    const name = field("name", ({ name }) => name, (wanted) => this.edit.rename(here(), wanted), "V-REP 3.x's scripts find it by this name; no other object has it; name: in the scene's file");
    if (one.of !== "scene") return [name];
    return [name, field("alias", ({ alias }) => alias, (wanted) => this.set("alias", wanted), "Its name in 4.x paths, which siblings may share; alias: in the scene's file")];
  }

  /** @param {wire.Property} property */
  row(property) {
    const described = { ...property, unit: this.unitOf(property) };
    const { key, kind, unit } = described;
    const field = (KINDS[kind] ?? other)(this, described);
    const row = this.line(key, hintOf(described), ...[field].flat());
    const parts = key === "size" ? PARTS[this.ones.at(-1)?.type ?? ""] : undefined;
    const [label] = row.children;
    if (parts ?? NAMES[key]) label.textContent = parts?.join(", ") ?? NAMES[key];
    if (unit) label.append(create("small", { textContent: ` ${unit === "rad" ? "°" : unit}` }));
    row.classList.add(kind);
    return row;
  }

  // Return a property's unit. A joint's units depend on its type, and on the mode of its motor.
  /** @param {wire.Property} property */
  unitOf({ key, unit }) {
    const [{ type, values }] = this.ones.slice(-1);
    if (type !== "joint" || !JOINTS[values.type]) return unit ?? "";
    const { place, speed, force } = JOINTS[values.type];
    const target = { position: place, velocity: speed, force }[values.mode] ?? "";
    return { limits: place, value: place, target, max_force: force }[key] ?? unit ?? "";
  }

  // Return a field for the density (kg/m³), which sets the mass; null unless the volumes of all selected objects are known.
  density() {
    if (!this.ones.every((each) => volumeOf(this.whole(each)))) return null;
    const take = (value, merge) => {
      /** @type {wire.Set[]} */
      const operations = this.ones.map((each) => ({ do: "set", object: each.handle, values: { mass: value * volumeOf(this.whole(each)) } }));
      return this.edit.do(operations, this.edit.named("Change"), merge);
    };
    const field = numberField("density", { take, ...this.answers, low: 0, step: 100, digits: 2 });
    this.fills.push((each) => field.fill((each.values.mass ?? 0) / volumeOf(this.whole(each))));
    const row = this.line("density", "Another density sets the mass", field);
    row.firstElementChild?.append(create("small", { textContent: " kg/m³" }));
    return row;
  }

  whole(one) {
    const size = (this.types?.[one.type] ?? []).find(({ key }) => key === "size")?.default;
    return { type: one.type, size: one.values.size ?? size };
  }

  // Return fields for the script parameters that have a value, and one to add another.
  parameters({ values: { script_parameters: known = {} } }) {
    const set = (name, value, merge) => this.set("script_parameters", { ...this.given, [name]: value }, merge);
    const rows = Object.keys(known).map((name) => this.line(name, `${name}: a parameter of its script`, this.parameter(name, known[name], set)));
    const more = create("input", { type: "text", placeholder: "name = value", "aria-label": "Another script parameter", spellcheck: false });
    more.onchange = () => {
      const [, name, text] = /^\s*([A-Za-z_]\w*)\s*=\s*(.+?)\s*$/.exec(more.value) ?? [];
      if (!name) return this.edit.wrong(`${more.value.slice(0, 40)}: must be a name, = and a value, such as speed = 2`);
      more.value = "";
      return set(name, Number.isFinite(Number(text)) ? Number(text) : text);
    };
    return create("div", { className: "parameters" }, create("h3", { textContent: "Script parameters" }), ...rows, this.line("another one", "", more));
  }

  get given() {
    return this.ones.at(-1)?.values.script_parameters ?? {};
  }

  parameter(name, value, set) {
    if (typeof value === "number") {
      const field = numberField(name, { take: (entered, merge) => set(name, entered, merge), ...this.answers, digits: 6 });
      this.fills.push(() => field.fill(this.given[name]));
      return field;
    }
    const field = create("input", { type: "text", "aria-label": name, onchange: () => set(name, field.value) });
    this.fills.push(() => document.activeElement === field || (field.value = this.given[name] ?? ""));
    return field;
  }
}

// Return the tooltip: the meaning of the value, its limits, and its key in the scene file.
/** @param {wire.Property} property */
function hintOf({ key, what, unit, least, most }) {
  const isLimited = typeof least === "number" && typeof most === "number" && most < MOST_SHOWN;
  const isAngle = unit === "rad";
  const [low, high] = [least, most].map((one) => (isAngle && isLimited ? degrees(one) : one));
  const limits = isLimited && [low, "to", high, isAngle ? "°" : unit].filter((one) => one !== "").join(" ");
  return [what, limits, `${key}: in the scene's file${isAngle ? ", in rad" : ""}`].filter(Boolean).join("; ");
}

const degrees = (angle) => Number((angle / DEGREE).toFixed(3));

// Return limits and conversions of a number field: angles are shown in degrees, and are rad in the scene file.
function inUnit({ unit, least, most }) {
  if (unit !== "rad") return { low: least, high: most, show: (value) => value, take: (value) => value };
  const [low, high] = [least, most].map((one) => one && degrees(one));
  return { low, high, show: (value) => value && value / DEGREE, take: (value) => value && Number((value * DEGREE).toFixed(9)), step: TURN, digits: 3 };
}

// ---- fields, by the kind of value

function number(panel, property) {
  const { key, default: fallback, whole: isWhole } = property;
  const { low, high, show, take, step = FINE[key] ?? STEP, digits } = inUnit(property);
  const field = numberField(labelOf(key), {
    take: (value, merge) => panel.set(key, take(value), merge), ...panel.answers, low, high, isWhole, digits,
    step: isWhole ? 1 : step, isFine: true, mayBeEmpty: fallback === null,
  });
  panel.follow(key, fallback, (value) => field.fill(show(value)));
  return field;
}

function several(panel, property) {
  const { key, default: fallback, count } = property;
  const { low, high, show, take, step = FINE[key] ?? STEP, digits } = inUnit(property);
  const names = key === "size" ? PARTS[panel.ones.at(-1).type] : undefined;
  const length = count ?? fallback?.length ?? 3;
  const now = () => panel.ones.at(-1).values[key] ?? fallback ?? Array(length).fill(0);
  const fields = [...Array(length).keys()].map((place) =>
    numberField(`${labelOf(key)} ${place + 1}`, {
      take: (value, merge) => panel.set(key, now().map((one, at) => (at === place ? take(value) : one)), merge),
      ...panel.answers, low, high, step, digits, ...(names ? { title: names[place] } : {}),
    }),
  );
  panel.follow(key, fallback, (value) => fields.forEach((field, place) => field.fill(show(value?.[place]))));
  return create("span", { className: "several" }, ...fields);
}

function onOff(panel, { key, default: fallback }) {
  const box = create("input", { type: "checkbox", "aria-label": labelOf(key) });
  box.onchange = () => panel.set(key, box.checked);
  panel.follow(key, fallback, (value) => (box.checked = Boolean(value)));
  return box;
}

function text(panel, { key, default: fallback }) {
  const placeholder = key === "script" ? "the one that you run" : "";
  const field = create("input", { type: "text", "aria-label": labelOf(key), placeholder, spellcheck: false });
  field.onchange = () => panel.set(key, field.value.trim() || null);
  panel.follow(key, fallback, (value) => document.activeElement === field || (field.value = value ?? ""));
  return field;
}

// A text field for a list of numbers of any length.
function list(panel, { key, default: fallback }) {
  const shown = (value) => (value ?? []).join(", ");
  const field = create("input", { type: "text", "aria-label": labelOf(key), placeholder: "numbers, with commas", spellcheck: false });
  field.onchange = () => {
    const entered = field.value.split(/[\s,]+/).filter(Boolean).map(Number);
    if (entered.every(Number.isFinite)) return panel.set(key, entered.length ? entered : null);
    panel.edit.wrong(`${labelOf(key)} = ${field.value.slice(0, 40)}: must be numbers, with commas between them`);
    field.value = shown(panel.ones.at(-1)?.values[key]);
  };
  panel.follow(key, fallback, (value) => document.activeElement === field || (field.value = shown(value)));
  return field;
}

function choice(panel, { key, default: fallback, choices }) {
  const select = create("select", { "aria-label": labelOf(key) }, ...(fallback === null ? [new Option("none", "")] : []), ...choices.map((one) => new Option(one, one)));
  select.onchange = () => panel.set(key, select.value || null);
  panel.follow(key, fallback, (value) => (select.value = value ?? ""));
  return select;
}

function color(panel, { key, default: fallback }) {
  const now = () => panel.ones.at(-1)?.values[key] ?? fallback ?? WHITE;
  const alpha = () => now()[3] ?? 1;
  const paint = create("input", { type: "color", "aria-label": labelOf(key) });
  const clear = create("input", { type: "range", min: 0, max: 1, step: 0.05, "aria-label": "opacity", title: "Opacity" });
  paint.onchange = () => panel.set(key, [...rgbOf(paint.value), alpha()]);
  clear.onchange = () => panel.set(key, [...now().slice(0, 3), clear.valueAsNumber]);
  panel.follow(key, fallback, () => {
    paint.value = hexOf(now());
    if (document.activeElement !== clear) clear.value = alpha();
  });
  return [create("span", { className: "paint" }, paint, clear)];
}

// A button that opens the scene's text, for values that are too long for a field.
function other(panel, { key, default: fallback }) {
  const button = create("button", { type: "button", title: "Written in the scene's text", onclick: () => panel.openText() });
  panel.follow(key, fallback, (value) => {
    const count = Array.isArray(value) ? value.length : isPlain(value) ? Object.keys(value).length : 0;
    button.textContent = same(value, fallback) || !count ? "in the text" : `${count}, in the text`;
  });
  return button;
}

const KINDS = { number, numbers: several, list, switch: onOff, text, file: text, choice, color };
