// What an object is like, by the keys that a scene file has for its type: a field for each, by the kind of its value.
import { create } from "../dom.js";
import { numberField } from "./number_field.js";
import { volumeOf } from "./volumes.js";

// What is changed most comes first; all else as the node tells it.
const FIRST = ["size", "color", "texture", "mass", "static", "respondable", "visible", "friction", "restitution", "script", "width", "height", "fov", "horizontal_fov", "near", "far", "every", "rate", "min_range", "max_range"];
const FINE = { size: 0.1, mass: 0.1 }; // steps of the arrow keys
const STEP = 0.1, TURN = 15; // degrees
const WHITE = [1, 1, 1, 1];
const DEGREE = Math.PI / 180; // rad

// Keys in groups; what is changed most is in none. Of a vehicle, all but its script is for experts; of a camera, all but its picture.
const GROUPS = {
  look: ["color", "texture", "visible"],
  physics: ["mass", "static", "respondable", "friction", "restitution"],
  camera: ["width", "height", "fov", "horizontal_fov", "near", "far", "every", "baseline", "lens", "size"],
  advanced: ["category", "size_factor", "inertia", "suffix"],
};
const OF_CAMERAS = ["vision_sensor", "vehicle_camera"];
const OF_VEHICLES = ["script", "start"];
// Where the key alone does not say it: as V-REP's dialogs call it.
const NAMES = {
  fov: "perspective angle", horizontal_fov: "horizontal angle", near: "near clipping plane", far: "far clipping plane",
  every: "a picture every", urdf: "body, a URDF file", cmd_vel_timeout: "commands time out after", objects: "V-REP's objects",
};
const JOINTS = { revolute: { place: "rad", speed: "rad/s", force: "N m" }, prismatic: { place: "m", speed: "m/s", force: "N" } };
// What the numbers of a size are.
const PARTS = { box: ["length", "width", "height"], cylinder: ["radius", "length"], capsule: ["radius", "length"], sphere: ["radius"], mesh: ["scale along x", "y", "z"] };

const words = (key) => NAMES[key] ?? key.replaceAll(/[_.]/g, " ");
const inner = (key) => words(key.slice(key.lastIndexOf(".") + 1));
function groupOf(key, type) {
  if (key.includes(".")) return words(key.slice(0, key.lastIndexOf(".")).replaceAll(".", ": "));
  if (type === "vehicle") return OF_VEHICLES.includes(key) ? "" : "advanced";
  if (OF_CAMERAS.includes(type)) return GROUPS.camera.includes(key) ? "camera" : "advanced";
  const [group = ""] = Object.entries(GROUPS).find(([name, keys]) => name !== "camera" && keys.includes(key)) ?? [];
  return group;
}
const MOST_SHOWN = 1e9; // what is beyond is no limit that anybody meets
const hex = (color) => `#${color.slice(0, 3).map((one) => Math.round(255 * one).toString(16).padStart(2, "0")).join("")}`;
const numbers = (text) => [1, 3, 5].map((from) => Number((parseInt(text.slice(from, from + 2), 16) / 255).toFixed(3)));
const isPlain = (value) => value !== null && typeof value === "object" && !Array.isArray(value);
const same = (one, other) => JSON.stringify(one) === JSON.stringify(other);

export class Properties {
  // `openText()` shows the scene as text, where what has no field can be written.
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
    this.types = null; // the keys of each type, once they have been asked for
    this.built = ""; // for what there are fields
    /** @type {((one: import("./objects.js").SceneObject) => void)[]} */
    this.fills = []; // show the values of now
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

  // The keys that all of what is selected have.
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
    const isPlain = this.ones.some(({ of, root, values }) => of === "vehicle" && !root && !Object.keys(values).length);
    const keys = one && !isPlain ? this.keys() : [];
    const rows = this.grouped(keys, one);
    if (one && this.ones.length === 1) rows.unshift(...this.names(one));
    if (one?.script && this.ones.length === 1) rows.push(this.parameters(one));
    if (isPlain) rows.push(create("p", { textContent: "A part of a vehicle: it has no properties of its own." }));
    this.element.replaceChildren(...rows.filter(Boolean));
    this.element.parentElement?.scrollTo(0, 0);
  }

  // Look, physics and camera are open; others stand folded, unless one of their keys says something.
  /**
   * @param {wire.Property[]} keys
   * @param {Partial<import("./objects.js").SceneObject>} [one]
   */
  grouped(keys, { values = {}, type } = {}) {
    const rows = [];
    const groups = new Map();
    const begin = (name) => create("details", { open: name !== "advanced" && name in GROUPS }, create("summary", { textContent: name }));
    for (const name of Object.keys(GROUPS)) if (keys.some(({ key }) => groupOf(key, type) === name)) groups.set(name, begin(name));
    for (const said of keys) {
      const name = groupOf(said.key, type);
      if (name && !groups.has(name)) groups.set(name, begin(name));
      const group = groups.get(name);
      if (!group) rows.push(this.row(said));
      else group.append(...[this.row(said), said.key === "mass" && this.density()].filter(Boolean));
      if (group && name !== "advanced" && !same(values[said.key] ?? said.default, said.default)) group.open = true;
    }
    return [...rows, ...groups.values()];
  }

  line(key, hint, ...parts) {
    const row = create("div", { className: "field", title: hint }, create("span", { textContent: inner(key) }), ...parts);
    row.dataset.key = key;
    return row;
  }

  set(key, value, merge) {
    return this.edit.set(this.edit.selected, { [key]: value }, merge);
  }

  // What number fields do, beside taking numbers.
  get answers() {
    return { wrong: (line) => this.edit.wrong(line), undo: (merge) => this.edit.undo("undo", merge) };
  }

  // Shows the value of now by `fill`.
  follow(key, otherwise, fill) {
    this.fills.push((one) => fill(one.values[key] ?? otherwise));
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

  /** @param {wire.Property} told */
  row(told) {
    const said = { ...told, unit: this.unitOf(told) };
    const { key, kind, unit } = said;
    const made = (KINDS[kind] ?? other)(this, said);
    const row = this.line(key, hintOf(said), ...[made].flat());
    const parts = key === "size" ? PARTS[this.ones.at(-1)?.type ?? ""] : undefined;
    const [label] = row.children;
    if (parts ?? NAMES[key]) label.textContent = parts?.join(", ") ?? NAMES[key];
    if (unit) label.append(create("small", { textContent: ` ${unit === "rad" ? "°" : unit}` }));
    row.classList.add(kind);
    return row;
  }

  // Those of a joint depend on its type, and on what its motor does.
  /** @param {wire.Property} property */
  unitOf({ key, unit }) {
    const [{ type, values }] = this.ones.slice(-1);
    if (type !== "joint" || !JOINTS[values.type]) return unit ?? "";
    const { place, speed, force } = JOINTS[values.type];
    const target = { position: place, velocity: speed, force }[values.mode] ?? "";
    return { limits: place, value: place, target, max_force: force }[key] ?? unit ?? "";
  }

  // Of what has a volume that is known: kg/m³, which sets the mass.
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

  // Of the script on an object: those that have a value, and a line for another one.
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

// What a value is, what is allowed, and its key in the scene's file.
/** @param {wire.Property} property */
function hintOf({ key, what, unit, least, most }) {
  const isLimited = typeof least === "number" && typeof most === "number" && most < MOST_SHOWN;
  const isAngle = unit === "rad";
  const [low, high] = [least, most].map((one) => (isAngle && isLimited ? degrees(one) : one));
  const limits = isLimited && [low, "to", high, isAngle ? "°" : unit].filter((one) => one !== "").join(" ");
  return [what, limits, `${key}: in the scene's file${isAngle ? ", in rad" : ""}`].filter(Boolean).join("; ");
}

const degrees = (angle) => Number((angle / DEGREE).toFixed(3));

// How a number is shown, and taken: angles in degrees.
function inUnit({ unit, least, most }) {
  if (unit !== "rad") return { low: least, high: most, show: (value) => value, take: (value) => value };
  const [low, high] = [least, most].map((one) => one && degrees(one));
  return { low, high, show: (value) => value && value / DEGREE, take: (value) => value && Number((value * DEGREE).toFixed(9)), step: TURN, digits: 3 };
}

// ---- the kinds of values

function number(panel, said) {
  const { key, default: otherwise, whole: isWhole } = said;
  const { low, high, show, take, step = FINE[key] ?? STEP, digits } = inUnit(said);
  const field = numberField(words(key), {
    take: (value, merge) => panel.set(key, take(value), merge), ...panel.answers, low, high, isWhole, digits,
    step: isWhole ? 1 : step, isFine: true, mayBeEmpty: otherwise === null,
  });
  panel.follow(key, otherwise, (value) => field.fill(show(value)));
  return field;
}

function several(panel, said) {
  const { key, default: otherwise, count } = said;
  const { low, high, show, take, step = FINE[key] ?? STEP, digits } = inUnit(said);
  const names = key === "size" ? PARTS[panel.ones.at(-1).type] : undefined;
  const length = count ?? otherwise?.length ?? 3;
  const now = () => panel.ones.at(-1).values[key] ?? otherwise ?? Array(length).fill(0);
  const fields = [...Array(length).keys()].map((place) =>
    numberField(`${words(key)} ${place + 1}`, {
      take: (value, merge) => panel.set(key, now().map((one, at) => (at === place ? take(value) : one)), merge),
      ...panel.answers, low, high, step, digits, ...(names ? { title: names[place] } : {}),
    }),
  );
  panel.follow(key, otherwise, (value) => fields.forEach((field, place) => field.fill(show(value?.[place]))));
  return create("span", { className: "several" }, ...fields);
}

function onOff(panel, { key, default: otherwise }) {
  const box = create("input", { type: "checkbox", "aria-label": words(key) });
  box.onchange = () => panel.set(key, box.checked);
  panel.follow(key, otherwise, (value) => (box.checked = Boolean(value)));
  return box;
}

function text(panel, { key, default: otherwise }) {
  const placeholder = key === "script" ? "the one that you run" : "";
  const field = create("input", { type: "text", "aria-label": words(key), placeholder, spellcheck: false });
  field.onchange = () => panel.set(key, field.value.trim() || null);
  panel.follow(key, otherwise, (value) => document.activeElement === field || (field.value = value ?? ""));
  return field;
}

// Numbers, as many as somebody wants.
function list(panel, { key, default: otherwise }) {
  const shown = (value) => (value ?? []).join(", ");
  const field = create("input", { type: "text", "aria-label": words(key), placeholder: "numbers, with commas", spellcheck: false });
  field.onchange = () => {
    const entered = field.value.split(/[\s,]+/).filter(Boolean).map(Number);
    if (entered.every(Number.isFinite)) return panel.set(key, entered.length ? entered : null);
    panel.edit.wrong(`${words(key)} = ${field.value.slice(0, 40)}: must be numbers, with commas between them`);
    field.value = shown(panel.ones.at(-1)?.values[key]);
  };
  panel.follow(key, otherwise, (value) => document.activeElement === field || (field.value = shown(value)));
  return field;
}

function choice(panel, { key, default: otherwise, choices }) {
  const select = create("select", { "aria-label": words(key) }, ...(otherwise === null ? [new Option("none", "")] : []), ...choices.map((one) => new Option(one, one)));
  select.onchange = () => panel.set(key, select.value || null);
  panel.follow(key, otherwise, (value) => (select.value = value ?? ""));
  return select;
}

function color(panel, { key, default: otherwise }) {
  const now = () => panel.ones.at(-1)?.values[key] ?? otherwise ?? WHITE;
  const alpha = () => now()[3] ?? 1;
  const paint = create("input", { type: "color", "aria-label": words(key) });
  const clear = create("input", { type: "range", min: 0, max: 1, step: 0.05, "aria-label": "opacity", title: "Opacity" });
  paint.onchange = () => panel.set(key, [...numbers(paint.value), alpha()]);
  clear.onchange = () => panel.set(key, [...now().slice(0, 3), clear.valueAsNumber]);
  panel.follow(key, otherwise, () => {
    paint.value = hex(now());
    if (document.activeElement !== clear) clear.value = alpha();
  });
  return [create("span", { className: "paint" }, paint, clear)];
}

// What is longer than a field is written in the text.
function other(panel, { key, default: otherwise }) {
  const button = create("button", { type: "button", title: "Written in the scene's text", onclick: () => panel.openText() });
  panel.follow(key, otherwise, (value) => {
    const count = Array.isArray(value) ? value.length : isPlain(value) ? Object.keys(value).length : 0;
    button.textContent = same(value, otherwise) || !count ? "in the text" : `${count}, in the text`;
  });
  return button;
}

const KINDS = { number, numbers: several, list, switch: onOff, text, file: text, choice, color };
