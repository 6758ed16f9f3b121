// The 3D scene of the page. It shows the frames and markers that the node sends, and sends the user's drags and pushes.
import * as THREE from "three";
import { ACCENT, isFloor, isSingleMesh, quality } from "./looks.js";
import { Batch } from "./batch.js";
import { Canvas } from "./canvas.js";
import { Gizmo } from "./gizmo.js";
import { Hand, headingOf } from "./hand.js";
import { Outline } from "./outline.js";
import { Surroundings } from "./surroundings.js";
import { keep, kept } from "../storage.js";
import { Words } from "./text.js";
import { Tree } from "./tree.js";
import { BEHIND, FOV, FREE, View } from "./view.js";

const BODIES = "view/bodies";
const OBJECTS = "objects"; // handle server of the scene's objects; their markers' layer is "scene"
const TARGETS = "markers"; // handle server of vehicles and of their green target spheres, and layer of these spheres
const BASE = "base_link", TRACK = "Track_base", EYE = "_optical";
const STEP = 0.05; // s, time step of the simulation
const HOVERED = 0xffffff;
const STORE = "scene"; // key in storage.js
const LAYERS = { path: "view/path", command: "view/command", forces: "view/forces", labels: "view/state" };
const SHOWN = { frames: false, path: true, command: true, forces: false, handles: true, labels: true, marks: true };

export class Scene {
  /**
   * @param {HTMLElement} element
   * @param {{ say: (message: wire.Said) => void }} node
   */
  constructor(element, { say }) {
    this.say = say;
    this.followedVehicle = "";
    this.pushes = 0.5; // N
    this.views = [BEHIND, FREE];
    this.selected = "";
    /** @type {Map<string, string>} */
    this.bodies = new Map(); // name of a vehicle -> prefix of its frames
    /** @type {Map<string, THREE.Object3D>} */
    this.handles = new Map(); // key(server, name) -> the handle's marker
    this.onViews = this.onLook = this.onSelect = () => {}; // callbacks of the View panel
    /** @type {import("../replay.js").Replay | null} */
    this.replay = null; // set while it shows a recorded flight
    /** @type {import("../edit/edit.js").Edit | null} */
    this.editing = null; // set while the Edit panel is open
    this.world = new THREE.Scene();
    this.world.matrixWorldAutoUpdate = false;
    this.camera = new THREE.PerspectiveCamera(FOV, 1, 0.05, 4000);
    this.tree = new Tree(this.world, () => this.change());
    this.batch = new Batch(this.world);
    this.view = new View(this.camera);
    this.view.onFree = () => this.look(FREE);
    this.gizmo = new Gizmo();
    this.outline = new Outline();
    this.canvas = new Canvas(element, (renderer, seconds) => this.paint(renderer, seconds));
    if (this.canvas.isFast) quality.anisotropy = 8;
    if (this.canvas.isFast) this.tree.smooth = STEP;
    this.surroundings = new Surroundings(this.world, this.canvas.isFast);
    this.canvas.onFit = (width, height) => this.fit(width, height);
    this.hand = new Hand(this);
    this.canvas.dom.tabIndex = 0;
    this.canvas.dom.setAttribute("role", "application");
    this.canvas.dom.setAttribute("aria-label", "The scene");
    this.shown = { ...SHOWN, shadows: this.canvas.isFast };
    const { view, shown } = kept(STORE, {});
    this.wanted = view ?? BEHIND; // a simulated camera may be added later
    this.show(shown ?? {});
    this.isUnframed = true; // until the first markers arrive
    this.canvas.fit();
  }

  // The name of the vehicle that the view from behind follows.
  get vehicle() {
    return this.followedVehicle;
  }

  set vehicle(name) {
    if (name === this.followedVehicle) return;
    this.followedVehicle = name;
    this.tree.isNew = true;
    this.change();
  }

  // ---- messages of the node

  take(header, bytes) {
    try {
      this.tree.take(header, new Float32Array(bytes.slice().buffer));
    } finally {
      this.canvas.then(() => this.say({ shown: "scene" }));
    }
  }

  change() {
    this.canvas.change();
  }

  // Update vehicles, handles, views and batches after frames or markers were added or removed.
  sort() {
    this.tree.isNew = false;
    this.bodies.clear();
    this.handles.clear();
    for (const object of this.tree.markers.values()) {
      const { layer, ns, kind, frame } = object.userData.said;
      if (layer === BODIES && frame.endsWith(BASE)) this.bodies.set(ns, frame.slice(0, -BASE.length));
      if (kind === "handle") this.handles.set(key(layer, ns), object);
    }
    const [first] = this.bodies.keys();
    if (!this.bodies.has(this.vehicle) && first !== undefined) this.followedVehicle = first;
    if (this.selected && !this.meshesOf(this.selected).length && !this.handleOf(this.selected)) this.select("");
    this.offerViews();
    this.batch.build(this.tree.markers.values());
  }

  // Show or hide each marker, and outline the hovered and the selected objects.
  arrange() {
    this.isArranged = true;
    for (const object of this.tree.markers.values()) object.visible = this.isShown(object.userData.said);
    this.mark();
  }

  rearrange() {
    this.isArranged = false;
    this.change();
  }

  isShown({ layer, ns }) {
    if (this.replay && (layer === TARGETS || (layer.startsWith("view/") && !isFloor({ layer, ns })))) return false;
    const areLabelsShown = this.shown.labels && this.editing?.held?.of !== "vehicle"; // the vehicle's handles would cover its labels
    if (layer === "view/height") return ns === "shadow" ? !this.shown.shadows : areLabelsShown;
    if (layer === LAYERS.labels) return areLabelsShown;
    if (layer === LAYERS.forces) return this.shown.forces || this.bodies.has(this.active);
    const [name] = Object.entries(LAYERS).find(([, one]) => one === layer) ?? [];
    return name ? this.shown[name] : true;
  }

  offerViews() {
    const prefix = this.bodies.get(this.vehicle) ?? "";
    // Frames of removed vehicles remain, with a prefix; a single vehicle may have none.
    const isOwn = (name) => name.startsWith(prefix) && !name.slice(prefix.length).includes("/");
    const cameras = [...this.tree.byName.keys()].filter((name) => name.endsWith(EYE) && isOwn(name)).sort();
    const views = [BEHIND, FREE, ...cameras];
    if (String(views) === String(this.views)) return;
    this.views = views;
    this.turn(views.includes(this.wanted) ? this.wanted : views.includes(this.view.name) ? this.view.name : BEHIND);
    this.onViews();
  }

  // ---- view

  look(view) {
    if (!this.views.includes(view)) return;
    this.wanted = view;
    this.keep();
    this.turn(view);
  }

  turn(view) {
    this.view.look(view);
    this.change();
    if (view === this.told) return;
    this.told = view;
    this.onLook();
  }

  // Point an initial free view at the vehicle or, without one, at the middle of the floor.
  beginFree() {
    if (!this.tree.markers.size) return;
    this.isUnframed = false;
    if (![this.wanted, this.view.name].includes(FREE)) return;
    this.turn(BEHIND);
    this.view.update(this.followed);
    this.view.lookAt(this.place(this.vehicle) ?? new THREE.Vector3(), 0);
    this.view.stepBack();
  }

  // Move the camera near object `name`, or near all objects if there is no vehicle and no selection. While editing: near
  // the selected objects.
  frame(name = "") {
    const wanted = name || this.selected || this.vehicle;
    const isThere = this.bodies.has(this.vehicle);
    if (this.editing?.last !== undefined) this.lookAt(this.editing.seen.meshesOf(this.editing.selected));
    else if (wanted === this.vehicle && isThere && this.view.name === BEHIND) this.view.reset();
    else this.lookAt(name || isThere || this.selected ? this.meshesOf(wanted) : this.meshes());
    this.change();
  }

  // Return the meshes of all objects in the scene, or of the floor if the scene is empty.
  meshes() {
    const names = new Set(this.things().map(({ userData }) => userData.said.ns));
    const meshes = [...names].flatMap((name) => this.meshesOf(name));
    return meshes.length ? meshes : [...this.tree.markers.values()].filter(({ userData: { said } }) => isFloor(said));
  }

  lookAt(meshes) {
    if (!meshes.length) return;
    const box = new THREE.Box3();
    for (const mesh of meshes) box.expandByObject(mesh);
    const ball = box.getBoundingSphere(new THREE.Sphere());
    this.view.lookAt(ball.center, ball.radius);
  }

  show(layers) {
    Object.assign(this.shown, layers);
    if (this.canvas.renderer) this.canvas.renderer.shadowMap.enabled = this.shown.shadows;
    this.surroundings.sun.castShadow = this.shown.shadows;
    this.surroundings.marks.visible = this.shown.marks;
    this.tree.showFrames(this.shown.frames);
    this.keep();
    this.rearrange();
  }

  select(name) {
    if (name === this.selected) return;
    this.selected = name;
    this.onSelect();
    this.rearrange();
  }

  keep() {
    keep(STORE, { view: this.wanted, shown: this.shown });
  }

  // Return a promise of a PNG image of the scene.
  snapshot() {
    if (!this.canvas.renderer) return Promise.reject(new Error("this browser draws no scene"));
    this.canvas.draw(); // the browser may have discarded the last frame
    return new Promise((resolve, reject) => this.canvas.dom.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture"))), "image/png"));
  }

  // Return the canvas as a video stream.
  stream() {
    const stream = this.canvas.dom.captureStream();
    this.change();
    return stream;
  }

  fit(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.unit = (2 * Math.tan(THREE.MathUtils.degToRad(FOV / 2))) / height; // m per CSS pixel at a distance of 1 m
    Words.unit = this.unit;
    this.world.traverse((one) => one instanceof Words && one.fixed && one.fit());
  }

  paint(renderer, seconds) {
    if (this.tree.isNew) {
      this.sort();
      this.isArranged = false;
    }
    if (!this.isArranged) this.arrange();
    if (this.tree.isMoved) this.batch.place();
    this.tree.isMoved = false;
    const isMoving = this.tree.advance(performance.now());
    this.editing?.dragged?.show();
    this.world.updateMatrixWorld();
    if (this.isUnframed) this.beginFree();
    const isLate = this.view.update(this.followed, seconds);
    this.camera.updateMatrixWorld();
    this.surroundings.follow(this.camera, this.place(this.vehicle) ?? this.view.aim);
    this.surroundings.sky.updateMatrixWorld();
    this.surroundings.ground.updateMatrixWorld();
    this.surroundings.sun.updateMatrixWorld();
    this.putGizmo();
    Words.above = this.gizmo.tip;
    renderer.clear();
    renderer.render(this.world, this.camera);
    this.outline.render(renderer, this.camera);
    this.gizmo.render(renderer, this.camera, this.unit);
    this.editing?.handles.render(renderer, this.camera);
    if (isLate || isMoving) this.change();
  }

  get followed() {
    if (this.view.name !== BEHIND) return this.tree.byName.get(this.view.name);
    return this.tree.byName.get(`${this.bodies.get(this.vehicle) ?? ""}${TRACK}`);
  }

  // Return a vehicle's position in the world, undefined if it is not known.
  place(vehicle) {
    const frame = this.baseOf(vehicle);
    return frame && new THREE.Vector3().setFromMatrixPosition(frame.matrixWorld);
  }

  baseOf(vehicle) {
    return this.bodies.has(vehicle) ? this.tree.byName.get(this.bodies.get(vehicle) + BASE) : undefined;
  }

  // ---- handles

  // The name of the object with the handles: the dragged one, else a hovered vehicle or target, else the selected one.
  get active() {
    if (this.hand.dragged) return this.hand.dragged.name;
    if (this.hand.hovered && this.handleOf(this.hand.hovered)?.userData.said.layer === TARGETS) return this.hand.hovered;
    return this.selected;
  }

  // Return the handle of a vehicle, target or object. A single vehicle's has another name: it is the one without a sphere.
  handleOf(name) {
    const own = this.handles.get(key(TARGETS, name)) ?? this.handles.get(key(OBJECTS, name));
    if (own || !this.bodies.has(name)) return own;
    return [...this.handles.values()].find((one) => one.userData.said.layer === TARGETS && !this.looks(TARGETS, one.userData.said.ns));
  }

  looks(layer, ns) {
    return [...this.tree.markers.values()].some(({ userData: { said } }) => said.layer === layer && said.ns === ns && said.kind !== "handle");
  }

  // Return the objects that the mouse can pick.
  things() {
    return [...this.tree.markers.values()].filter((one) => isThing(one.userData.said));
  }

  meshesOf(name) {
    /** @type {THREE.Mesh[]} */
    const meshes = [];
    for (const object of this.things()) {
      if (object.userData.said.ns !== name) continue;
      object.traverse((one) => isSingleMesh(one) && meshes.push(one));
    }
    return meshes;
  }

  mark() {
    if (this.editing) return this.outline.show(this.editing.seen.lit());
    /** @type {[THREE.Mesh[], number, number][]} */
    const lit = [];
    if (this.hand.hovered && this.hand.hovered !== this.selected) lit.push([this.meshesOf(this.hand.hovered), HOVERED, 1.5]);
    if (this.selected) lit.push([this.meshesOf(this.selected), ACCENT, 2.5]);
    this.outline.show(lit);
  }

  putGizmo() {
    if (this.editing) return void (this.gizmo.put(null), this.editing.putHandles());
    const name = this.active;
    const handle = name && this.shown.handles ? this.handleOf(name) : null;
    if (!handle) return this.gizmo.put(null);
    if (this.hand.dragged?.now) return this.gizmo.put(this.hand.dragged.now.place, this.hand.dragged.now.heading);
    this.gizmo.put(this.place(name) ?? handle.getWorldPosition(new THREE.Vector3()), headingOf(handle));
  }
}

const key = (server, name) => `${server} ${name}`;

// Return whether the mouse can pick the marker: a vehicle's body, an object or a target sphere.
const isThing = ({ layer, kind }) => kind !== "handle" && [BODIES, "scene", TARGETS].includes(layer);
