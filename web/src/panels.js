// The parts of the page other than scene and editor: toolbar, side panels, start page and notice.
import { Board } from "./board.js";
import { Build } from "./edit/build.js";
import { Cameras } from "./cameras.js";
import { ToAll, isWatching } from "./course.js";
import { at, icon } from "./dom.js";
import { Log } from "./log.js";
import { Notice } from "./notice.js";
import { Plots } from "./plots.js";
import { Side } from "./side.js";
import { Start } from "./start.js";
import { Toolbar } from "./toolbar.js";
import { Tune } from "./tune.js";
import { View } from "./view.js";

const NO_EFFECT = /^warning: .*: no effect: /; // a line of the log: why a button had no effect
const STARTED = /^started(?: in |$)/; // a line of the log: the simulation was started
const NARROW = matchMedia("(max-width: 1120px)"); // too narrow to edit the scene beside the script
const TOUCH = matchMedia("(pointer: coarse), (max-width: 900px)"); // screens on which the script covers the scene

/**
 * Sends a request and shows its reply.
 * @typedef {<Name extends "call" | "request" | "speed" | "scene" | "vehicle" | "camera">(ask: Name, more: wire.Questions[Name][0]) => Promise<void>} Act
 */

export class Panels {
  // `socket` and `scene` are functions, because the socket is created later. `go` has the actions of the start page;
  // `open(script)` opens a script, `goTo(file, line)` shows a line of a file.
  /**
   * @param {{ store: import("./state/store.js").Store, socket: () => import("./socket.js").PageSocket,
   *   scene: () => import("./scene/scene.js").Scene,
   *   go: { tutorial: () => void, tasks: () => wire.Lesson[], take: (name: string, byKey?: boolean) => void },
   *   open: (script: string) => void, goTo: (file: string, line: number) => void }} page
   */
  constructor({ store, socket, scene, go, open, goTo }) {
    this.store = store;
    this.scene = scene;
    for (const element of document.querySelectorAll("[data-icon]")) element.prepend(icon(element.dataset.icon));
    this.board = new Board();
    this.notice = new Notice(store);
    /** @type {wire.Ask} */
    this.ask = (ask, more) => socket().ask(ask, more);
    /** @param {wire.Said} message */
    this.say = (message) => socket().say(message);
    this.toolbar = new Toolbar(store, this.board, (ask, more) => this.act(ask, more), this.notice, scene);
    this.cameras = new Cameras(this.board, (ask, more) => this.act(ask, more));
    this.plots = new Plots(this.board, this.ask);
    this.tune = new Tune(this.board, this.ask, this.notice);
    this.log = new Log(this.board);
    this.view = new View(scene());
    const ofScript = { openScript: (file) => goTo(file, 1), showScript: (is) => this.showScript(is) };
    this.build = new Build(scene(), this.ask, this.notice, ofScript);
    this.side = new Side((panel) => {
      this.plots.show(panel === "plots");
      this.edits = panel === "edit";
      if (this.isConnected) this.turnEditing(); // otherwise, connected() does it
      if (this.edits && NARROW.matches) this.showScript(false);
      if (panel === "view") this.view.list();
      this.markPlace(panel);
    });
    at("why").onclick = () => this.side.open("log");
    this.board.on("vehicles", ({ now }) => (scene().vehicle = now));
    for (const button of this.places) button.onclick = () => this.showPlace(button.dataset.place);
    at("toggle").onclick = () => this.showScript(document.body.classList.contains("wide"));
    this.showScript(!TOUCH.matches && !isWatching && !(this.edits && NARROW.matches));
    const choices = { tutorial: () => this.enter(go.tutorial), fly: () => this.showScript(false), build: () => this.showPlace("edit") };
    const gallery = { list: go.tasks, take: (name, byKey) => this.enter(() => go.take(name, byKey)) };
    this.start = new Start(choices, gallery, (script) => this.enter(() => open(script)));
    const take = (lesson) => {
      at("start-page").close();
      this.enter(() => go.take(lesson));
    };
    const load = (file) => {
      at("start-page").close();
      this.act("scene", { scene: file });
    };
    new ToAll(this.board, take, load);
    this.keys();
  }

  enter(go) {
    this.showScript(true);
    go();
  }

  // ---- the tabs on a tablet in portrait orientation

  get places() {
    return [...document.querySelectorAll("[data-place]")];
  }

  showPlace(place) {
    this.showScript(place === "script");
    if (place !== "script") this.side.open(place === "edit" ? "edit" : "");
  }

  showScript(is) {
    document.body.classList.toggle("wide", !is);
    at("toggle").setAttribute("aria-expanded", String(is));
    this.markPlace(this.side?.now);
  }

  markPlace(panel) {
    const isWide = document.body.classList.contains("wide");
    const now = !isWide ? "script" : panel === "edit" ? "edit" : "scene";
    for (const button of this.places) button.setAttribute("aria-pressed", String(button.dataset.place === now));
  }

  // Send a request, and show its reply or its error as a notice.
  /** @type {Act} */
  async act(ask, more) {
    this.notice.clear();
    try {
      const { said, done = true } = await this.ask(ask, more);
      if (said) this.notice.say(done ? said : `${"call" in more ? more.call : ask}: failed: ${said}`, !done);
    } catch (error) {
      this.notice.say(error.message, true);
    }
  }

  keys() {
    at("help-open").onclick = () => at("sheet").showModal();
    at("help-close").onclick = () => at("sheet").close();
    at("sheet").onclick = (event) => {
      if (event.target === at("sheet")) at("sheet").close();
    };
    window.addEventListener("keydown", (event) => {
      if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.target?.closest?.("input, textarea, select, [contenteditable], dialog")) return;
      if (event.key === "?") at("sheet").showModal();
      if (event.key.toLowerCase() === "v") this.view.next();
    });
  }

  // Turn editing on or off. The cockpit sends changes of the object tree only to pages that edit.
  turnEditing() {
    this.say({ follow_tree: Boolean(this.edits) });
    this.build.turn(this.edits);
  }

  // ---- messages from the cockpit

  async connected() {
    const whole = await this.ask("panel");
    this.version = Math.max(this.version ?? 0, whole.version);
    this.board.take(whole);
    this.isConnected = true;
    this.turnEditing();
    this.build.edit.connected();
    this.start.load();
    this.log.begin(whole.lines);
  }

  /** @param {wire.Told} message */
  told(message) {
    const { panel, version = 0, log = "" } = message;
    if (panel) {
      if (version > this.version + 1) this.connected().catch(() => {}); // a message was missed: request all parts
      this.version = version;
      this.board.take({ panel, version });
    }
    if (log) this.log.add(log);
    if (STARTED.test(log)) {
      this.store.take("started");
      this.scene().select(""); // the handles of a selected object would stay in view during the flight
    }
    if (message.pulse) this.store.take("pulse", message.pulse);
    if (NO_EFFECT.test(log)) this.notice.warn(log);
    this.build.told(message);
    if (message.pictures) this.cameras.show(message.pictures);
  }

  lost() {
    this.version = undefined; // a restarted cockpit counts from the beginning
    this.board.begin();
    this.build.edit.lost();
  }
}
