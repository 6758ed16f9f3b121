// Shelf of models, with pictures. A model or a file that is dragged into the scene is added at the point under the mouse.
import * as THREE from "three";
import { create } from "../dom.js";
import { askFor } from "./ask.js";
import { isFree } from "./edit_hand.js";
import { follow } from "./follow.js";
import { onGrid } from "./handles.js";
import { Landing } from "./landing.js";
import { WORLD } from "./objects.js";

const FAR = 5; // px of motion that make a press a drag
const ROOM = 1; // m, least width of the place for a model, also if its size is unknown
const GAP = 0.5, REACH = 16; // m between two places that are tried, and their number in each direction
const SEEN = 0.85; // of half the picture: a place farther from its center is not in view
const UNTOLD = 2000; // ms for which the place of an added model is taken until the node sends its object
const LARGEST = 5 << 20; // bytes of a file: base64 is a third longer, and messages are limited
const FILES = /\.(?:ttm|obj|stl|dae|urdf|ya?ml)$/i;

export class Models {
  /**
   * @param {HTMLElement} shelf
   * @param {HTMLInputElement} find
   * @param {import("./edit.js").Edit} edit
   */
  constructor(shelf, find, edit) {
    this.shelf = shelf;
    this.find = find;
    this.edit = edit;
    /** @type {wire.Questions["models"][1]["groups"]} */
    this.groups = [];
    /** @type {Map<string | undefined, Pick<wire.Model, "op" | "title">>} */
    this.ops = new Map(); // by model, of those that are shown
    this.taken = []; // boxes of models that were added without a drag, and whose objects the node has not sent yet
    this.landing = new Landing(edit.scene);
    find.oninput = () => this.show();
    find.addEventListener("keydown", (event) => event.key === "Escape" && this.clear(event));
    shelf.addEventListener("pointerdown", (event) => this.down(event));
    shelf.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("keydown", (event) => event.key === "Escape" && this.end(), true);
    this.listen(edit.scene.canvas.element);
    edit.on("mode", () => edit.isOn && !this.groups.length && this.ask());
  }

  ask() {
    return this.edit.ask("models").then(({ groups }) => {
      this.groups = groups;
      this.show();
    }, (error) => this.edit.wrong(error.message));
  }

  clear(event) {
    if (!this.find.value) return;
    event.stopPropagation();
    this.find.value = "";
    this.show();
  }

  show() {
    const term = this.find.value.trim().toLowerCase();
    this.ops.clear();
    const elements = this.groups.flatMap(({ name, models }) => {
      const matches = models.filter(({ title }) => `${title} ${name}`.toLowerCase().includes(term));
      return matches.length ? [create("h3", { textContent: name }), create("div", { className: "cards", role: "group", "aria-label": name }, ...matches.map((one) => this.card(one)))] : [];
    });
    this.shelf.replaceChildren(...(elements.length ? elements : [create("p", { textContent: "There is no such model." })]));
  }

  card({ model, title, picture, op }) {
    this.ops.set(model, { op, title });
    const image = picture ? create("img", { src: picture, alt: "", draggable: false }) : create("span", { className: "blank" });
    const card = create("button", { type: "button", className: "card", title: `${title}: drag it into the scene, or click on it` }, image, create("span", { textContent: title }));
    card.dataset.model = model;
    return card;
  }

  // ---- mouse, touch and keys

  down(event) {
    const card = event.target.closest(".card");
    if (!card || event.button) return;
    this.began = { ...this.ops.get(card.dataset.model), x: event.clientX, y: event.clientY, card };
    follow(event, (moved) => this.began && this.move(moved), (_, isCancelled) => (isCancelled ? this.end() : this.began && this.up()));
  }

  move(event) {
    const { x, y, card, title } = this.began;
    if (!this.label) {
      if (Math.hypot(event.clientX - x, event.clientY - y) < FAR) return;
      this.label = create("div", { className: "drag-label with-picture" }, card.firstElementChild.cloneNode(), title);
      document.body.append(this.label);
    }
    this.label.style.translate = `${event.clientX + 12}px ${event.clientY + 8}px`;
    this.place = this.aim(event);
    this.label.classList.toggle("wrong", !this.place);
  }

  up() {
    const { op, title } = this.began;
    const { label, place } = this;
    this.end();
    if (!label) this.putBeside(op, title);
    else if (place) this.put(op, title, place);
  }

  end() {
    this.label?.remove();
    this.landing.show(null);
    this.began = this.label = this.place = undefined;
  }

  // Mark and return the place in the world where the model would land; undefined outside the scene and in the sky.
  aim(event) {
    const { edit } = this;
    const isScene = document.elementFromPoint(event.clientX, event.clientY) === edit.scene.canvas.dom;
    const hit = isScene && edit.hand.meet(event);
    const place = hit ? this.snapped(hit.point.toArray(), isFree(event)) : undefined;
    this.landing.show(place);
    return place;
  }

  snapped([x, y, z], free) {
    return this.edit.handles.isSnapped !== free ? [onGrid(x), onGrid(y), Number(z.toFixed(4))] : [x, y, z].map((one) => Number(one.toFixed(4)));
  }

  key(event) {
    const card = event.target.closest?.(".card");
    if (event.key !== "Enter" || !card) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.repeat) return;
    const added = this.ops.get(card.dataset.model);
    if (added) this.putBeside(added.op, added.title);
  }

  // Add a model that was not dragged, at a free place near the point that the camera looks at.
  putBeside(op, title) {
    const place = this.freePlace(Math.max(ROOM, ...(op.objects?.[0].size ?? [])) / 2);
    this.put(op, title, this.snapped([place.x, place.y, 0], false));
  }

  // Return the place nearest to the camera's aim that is free within `half` (m); if possible in view and on the floor.
  freePlace(half) {
    const { edit } = this;
    const { camera, view } = edit.scene;
    const { x, y } = view.aim;
    const now = performance.now();
    this.taken = this.taken.filter(({ until }) => until > now);
    const others = edit.objects.children(WORLD).filter((one) => edit.objects.existing(one).of !== "floor");
    const boxes = [...others.map((one) => edit.seen.boxOf([one])), ...this.taken.map(({ box }) => box)];
    const isFree = (place) => boxes.every(({ min, max }) => ["x", "y"].some((axis) => place[axis] < min[axis] - half || place[axis] > max[axis] + half));
    const isSeen = (place) => [place.clone().project(camera)].every((at) => Math.abs(at.x) < SEEN && Math.abs(at.y) < SEEN && at.z < 1);
    const offsets = [...Array(2 * REACH + 1).keys()].map((one) => (one - REACH) * GAP);
    const places = offsets.flatMap((dx) => offsets.map((dy) => new THREE.Vector3(x + dx, y + dy, 0)));
    const distance = (place) => Math.hypot(place.x - x, place.y - y);
    const free = places.sort((one, other) => distance(one) - distance(other)).filter(isFree);
    const end = (edit.objects.named("Floor")?.values.size ?? Infinity) / 2 - half;
    const isOnFloor = (place) => Math.max(Math.abs(place.x), Math.abs(place.y)) <= end;
    const visible = free.filter(isSeen);
    const place = visible.find(isOnFloor) ?? visible[0] ?? free[0] ?? places[0];
    this.taken.push({ box: new THREE.Box3().expandByPoint(place).expandByScalar(half), until: now + UNTOLD });
    return place;
  }

  put(op, title, position) {
    const add = (more) => this.edit.make([{ ...op, ...more, position, yaw: op.yaw ?? 0 }], `Add ${title}`);
    if (op.text === undefined) return add();
    askFor(title, [{ label: "Text", value: op.text }], "Put it there", ([text]) => add({ text }));
  }

  // ---- files

  listen(place) {
    const isOfFiles = (event) => this.edit.isOn && event.dataTransfer?.types.includes("Files");
    const over = (on) => (event) => {
      if (!isOfFiles(event)) return;
      event.preventDefault();
      place.classList.toggle("drop", on);
      if (on) this.aim(event);
      else this.landing.show(null);
    };
    place.addEventListener("dragover", over(true));
    place.addEventListener("dragleave", over(false));
    place.addEventListener("drop", (event) => {
      if (!isOfFiles(event)) return;
      const spot = this.aim(event) ?? [0, 0, 0];
      over(false)(event);
      this.upload([...event.dataTransfer.files], spot);
    });
  }

  async upload(files, place) {
    for (const file of files) {
      try {
        if (!FILES.test(file.name)) throw new Error(`${file.name}: a model's name ends in .ttm, .obj, .stl, .dae, .urdf or .yaml`);
        if (file.size > LARGEST) throw new Error(`${file.name}: has ${file.size} bytes; at most ${LARGEST} can be dropped`);
        const { model } = await this.edit.ask("upload_model", { name: file.name, content: await base64(file) });
        await this.put(model, file.name, place);
      } catch (error) {
        this.edit.wrong(error.message);
      }
    }
    await this.ask();
  }
}

function base64(file) {
  return new Promise((resolve, reject) => {
    const reader = new FileReader();
    reader.onload = () => resolve(String(reader.result).split(",")[1] ?? "");
    reader.onerror = () => reject(new Error(`${file.name}: cannot be read`));
    reader.readAsDataURL(file);
  });
}
