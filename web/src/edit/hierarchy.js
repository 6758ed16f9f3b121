// Object tree beside the scene. Only the rows in view have elements, so that 2000 objects scroll smoothly.
import { create, icon } from "../dom.js";
import { iconOf } from "./kinds.js";
import { RowDrag } from "./row_drag.js";
import { WORLD } from "./objects.js";

const ROW = 32; // px, height of a row, large enough for a finger
const MORE = 8; // rows with elements above and below those in view
const INDENT = 14; // px per level

/** @typedef {import("./objects.js").SceneObject} SceneObject */

export class Hierarchy {
  // `tree` is the element that scrolls, `find` the search field above it.
  /**
   * @param {HTMLElement} tree
   * @param {HTMLInputElement} find
   * @param {import("./edit.js").Edit} edit
   */
  constructor(tree, find, edit) {
    this.tree = tree;
    this.find = find;
    this.edit = edit;
    this.folded = new Set(); // handles of folded rows
    this.known = new Set(); // handles whose rows were folded at first, or folded or unfolded by the user
    this.rows = []; // { handle, depth } of all rows that are not hidden by folding or the search, from top to bottom
    this.body = create("div", { className: "rows", role: "presentation" });
    tree.append(this.body);
    tree.onscroll = () => this.draw();
    new ResizeObserver(() => this.draw()).observe(tree);
    find.oninput = () => this.seek();
    find.onkeydown = (event) => this.keyOfFind(event);
    tree.onkeydown = (event) => this.key(event);
    new RowDrag(tree, edit, (handle) => this.range(handle), () => this.rename());
    edit.on("tree", () => this.list());
    edit.on("selection", () => this.reveal());
  }

  get objects() {
    return this.edit.objects;
  }

  isMatch({ alias, name, type }) {
    return `${alias} ${name} ${type}`.toLowerCase().includes(this.find.value.trim().toLowerCase());
  }

  // ---- list of the rows

  // Show the objects that match the search, from the first one.
  seek() {
    this.tree.scrollTop = 0;
    this.list();
  }

  list() {
    for (const one of this.objects.all()) this.begin(one);
    const matches = this.found();
    this.rows = [];
    const addRows = (handle, depth) => {
      if (matches && !matches.has(handle)) return;
      this.rows.push({ handle, depth });
      if (matches || !this.folded.has(handle)) for (const child of this.objects.children(handle)) addRows(child, depth + 1);
    };
    for (const handle of this.objects.children(WORLD)) addRows(handle, 0);
    this.body.style.height = `${this.rows.length * ROW}px`;
    this.draw();
  }

  // Fold a new model, vehicle or part of a vehicle except dummies: their children are seldom of interest.
  begin({ handle, model, of, type }) {
    if (!(model || (of === "vehicle" && type !== "dummy")) || this.known.has(handle)) return;
    this.known.add(handle);
    this.folded.add(handle);
  }

  // Return the handles of objects that match the search, with their ancestors; null without a search.
  found() {
    if (!this.find.value.trim()) return null;
    const matches = new Set();
    for (const one of this.objects.all()) {
      if (!this.isMatch(one)) continue;
      for (let ancestor = /** @type {SceneObject | undefined} */ (one); ancestor && !matches.has(ancestor.handle); ancestor = this.objects.get(ancestor.parent)) matches.add(ancestor.handle);
    }
    return matches;
  }

  fold(handle, folded) {
    folded ? this.folded.add(handle) : this.folded.delete(handle);
    this.known.add(handle);
    this.list();
  }

  // Unfold the ancestors of the object that was selected last, and scroll to it.
  reveal() {
    const last = this.edit.last;
    const foldedAncestors = this.objects.above(last).filter((one) => this.folded.has(one));
    for (const one of foldedAncestors) this.folded.delete(one);
    if (foldedAncestors.length) this.list();
    const at = this.rows.findIndex(({ handle }) => handle === last);
    if (at >= 0) {
      const { scrollTop, clientHeight } = this.tree;
      if (at * ROW < scrollTop) this.tree.scrollTop = at * ROW;
      else if ((at + 1) * ROW > scrollTop + clientHeight) this.tree.scrollTop = (at + 1) * ROW - clientHeight;
    }
    this.draw();
  }

  // ---- elements of the rows in view

  draw() {
    if (this.renaming) return;
    const first = Math.max(0, Math.floor(this.tree.scrollTop / ROW) - MORE);
    const count = Math.ceil(this.tree.clientHeight / ROW) + 2 * MORE;
    const elements = this.rows.slice(first, first + count).map((row, number) => this.row(row, first + number));
    this.body.replaceChildren(...elements);
    this.tree.setAttribute("aria-activedescendant", this.edit.last === undefined ? "" : `object-${this.edit.last}`);
  }

  row({ handle, depth }, number) {
    const one = this.objects.existing(handle);
    const row = create("div", { className: "row", role: "treeitem", id: `object-${handle}`, title: `${one.name}: ${one.type}` });
    row.dataset.handle = handle;
    row.style.cssText = `top:${number * ROW}px;padding-left:${4 + depth * INDENT}px`;
    row.setAttribute("aria-level", String(depth + 1));
    row.setAttribute("aria-selected", String(this.edit.has(handle)));
    row.append(this.folder(row, handle), icon(iconOf(one)), create("span", { className: "name", textContent: one.name }));
    if (one.script) row.append(this.script(one));
    return row;
  }

  folder(row, handle) {
    const hasChildren = this.objects.children(handle).length > 0;
    const folded = this.folded.has(handle);
    if (hasChildren) row.setAttribute("aria-expanded", !folded);
    const attributes = { className: "folder", type: "button", tabIndex: -1, "aria-label": folded ? "Unfold" : "Fold", textContent: folded ? "▸" : "▾" };
    return hasChildren ? create("button", { ...attributes, onclick: () => this.fold(handle, !folded) }) : create("span", { className: "folder" });
  }

  script(one) {
    const attributes = { className: "script", type: "button", tabIndex: -1, title: `Open the script of ${one.name}`, "aria-label": `Open the script of ${one.name}` };
    return create("button", { ...attributes, onclick: () => this.edit.openScript(one) }, icon("script"));
  }

  // ---- keys

  key(event) {
    if (event.target.matches("input") || event.ctrlKey || event.metaKey || event.altKey) return;
    const { last } = this.edit;
    const acts = {
      ArrowDown: () => this.step(1, event.shiftKey),
      ArrowUp: () => this.step(-1, event.shiftKey),
      ArrowRight: () => this.fold(last, false),
      ArrowLeft: () => (this.folded.has(last) || !this.objects.children(last).length ? this.selectParent() : this.fold(last, true)),
      Home: () => this.edit.select([this.rows[0]?.handle]),
      End: () => this.edit.select([this.rows.at(-1)?.handle]),
      F2: () => this.rename(),
      Enter: () => this.rename(), // otherwise Enter would stop the flight
    };
    if (!(event.key in acts)) return;
    acts[event.key]();
    event.preventDefault();
    event.stopPropagation();
  }

  keyOfFind(event) {
    if (event.key === "ArrowDown" || event.key === "Enter") {
      const row = this.rows.find(({ handle }) => this.isMatch(this.objects.existing(handle)));
      if (row) this.edit.select([row.handle]);
      this.tree.focus();
    } else if (event.key === "Escape" && this.find.value) this.find.value = "";
    else return;
    this.list();
    event.preventDefault();
    event.stopPropagation();
  }

  selectParent() {
    const parent = this.objects.get(this.objects.get(this.edit.last)?.parent);
    if (parent) this.edit.select([parent.handle]);
  }

  step(offset, more) {
    const at = this.rows.findIndex(({ handle }) => handle === this.edit.last);
    const row = this.rows[Math.min(Math.max(0, at + offset), this.rows.length - 1)];
    if (row) this.edit.select([row.handle], more);
  }

  // Select all rows from the one that was selected last to this one.
  range(handle) {
    const indexOf = (wanted) => this.rows.findIndex((row) => row.handle === wanted);
    const [from, to] = [indexOf(this.edit.last), indexOf(handle)];
    const range = this.rows.slice(Math.min(from, to), Math.max(from, to) + 1).map((row) => row.handle);
    this.edit.select([...(from < 0 ? [] : range.filter((one) => one !== handle)), handle], true);
  }

  // ---- a new name

  rename(handle = this.edit.last) {
    const one = this.objects.get(handle);
    const name = this.body.querySelector(`#object-${handle} .name`);
    if (!one || !name || this.renaming || !this.edit.mayRename(one)) return;
    const field = create("input", { value: one.name, "aria-label": `New name of ${one.name}`, spellcheck: false, maxLength: 100 });
    const end = (wanted) => {
      if (!this.renaming) return;
      this.renaming = false;
      this.draw();
      this.tree.focus();
      if (wanted && wanted !== one.name) this.edit.rename(one, wanted);
    };
    field.onblur = () => end(field.value.trim());
    field.onkeydown = (event) => {
      if (event.key === "Enter") end(field.value.trim());
      if (event.key === "Escape") end("");
      event.stopPropagation();
    };
    this.renaming = true;
    name.replaceWith(field);
    field.select();
  }
}
