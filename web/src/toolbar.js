// The toolbar above the scene, and its keyboard shortcuts.
import { Recorder } from "./recorder.js";
import { at, create, save, stamp } from "./dom.js";

const STARTS = ["start", "restart"];
const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 0];

const speedText = (factor) => (factor === 0 ? "fastest" : `${factor} ×`);

// Return the texts without duplicates and without beginnings of others: a script's error is also reported for its vehicle.
const distinct = (texts) => [...new Set(texts)].filter((one, _, all) => !all.some((other) => other !== one && other.startsWith(one)));

// Return whether a key belongs to its target: any key in fields, texts, bars and dialogs, Space and Enter on buttons and links.
const usesKey = ({ target, key }) =>
  target.closest?.("input, textarea, select, article, summary, [contenteditable], [role=separator], dialog") ||
  ([" ", "Enter"].includes(key) && target.closest?.("button, a"));

export class Toolbar {
  // `act(ask, more)` sends a request and shows its reply; `scene()` returns the scene.
  /**
   * @param {import("./state/store.js").Store} store
   * @param {import("./board.js").Board} board
   * @param {import("./panels.js").Act} act
   */
  constructor(store, board, act, notice, scene) {
    this.store = store;
    this.board = board;
    this.act = act;
    for (const [id, press] of Object.entries({
      "sim-start": () => this.call(this.is("paused") ? "resume" : "start"),
      "sim-pause": () => this.call({ flying: "pause", paused: "resume" }[this.status] ?? "start"),
      "sim-step": () => this.call(this.is("flying") ? "pause" : "step"),
      "sim-restart": () => this.call("restart"),
      "sim-stop": () => this.call("stop"),
      snapshot: () => this.call("snapshot"),
      restore: () => this.call("restore"),
      takeoff: () => act("request", { request: "takeoff" }),
      land: () => act("request", { request: "land" }),
      reset: () => act("request", { request: "reset" }),
      "go-home": () => act("request", { request: "home" }),
      photo: () => scene().snapshot().then((blob) => save(blob, `drone_sim-${stamp()}.png`)),
      "toolbar-more": () => this.unfold(),
    }))
      at(/** @type {"home"} */ (id)).onclick = press;
    new Recorder(at("video"), () => scene().stream(), "scene", notice);
    at("speed").onchange = () => act("speed", { factor: Number(at("speed").value) });
    at("scene-choice").onchange = () => act("scene", { scene: at("scene-choice").value });
    at("vehicle").onchange = () => act("vehicle", { vehicle: at("vehicle").value });
    for (const part of /** @type {const} */ (["status", "flight", "master", "hears_commands", "pace"])) board.on(part, (content) => store.take(part, content));
    board.on("diagnosis", (all) => store.take("warnings", distinct(all.filter((one) => one.wrong).map((one) => one.said))));
    board.on("speed", (factor) => this.showSpeed(factor));
    board.on("scenes", ({ all, now }) => this.offer(at("scene-choice"), all, now));
    board.on("vehicles", ({ all, now }) => {
      this.offer(at("vehicle"), all, now);
      at("vehicle-part").hidden = all.length < 2;
    });
    this.listen();
  }

  get status() {
    return this.store.now.status;
  }

  is(status) {
    return this.status === status;
  }

  call(service) {
    if (STARTS.includes(service)) this.store.take("run");
    return this.act("call", { call: service });
  }

  unfold() {
    const open = at("toolbar").classList.toggle("unfolded");
    at("toolbar-more").setAttribute("aria-expanded", String(open));
  }

  // Add the keyboard shortcuts. A clicked button loses the focus, or the next Space would press it again.
  listen() {
    const buttons = [...document.querySelectorAll("button")].filter(({ dataset }) => dataset.key);
    for (const button of buttons) {
      button.title += ` (${button.dataset.key?.replace(" ", ", ")})`;
      button.addEventListener("click", (event) => event.detail && button.blur());
    }
    window.addEventListener("keydown", (event) => {
      if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || event.repeat || usesKey(event)) return;
      const key = event.key === " " ? "Space" : event.key.length === 1 ? event.key.toUpperCase() : event.key;
      const shortcutButton = buttons.find((one) => one.dataset.key?.split(" ").includes(key));
      const button = key === "Enter" && this.is("stopped") ? at("sim-start") : shortcutButton;
      if (!button || button.disabled) return;
      event.preventDefault();
      button.click();
    });
  }

  showSpeed(factor) {
    const speeds = SPEEDS.includes(factor) ? SPEEDS : [factor, ...SPEEDS];
    at("speed").replaceChildren(...speeds.map((one) => new Option(speedText(one), one)));
    at("speed").value = factor;
  }

  offer(select, all, now) {
    const labelOf = (one) => (one === "none" ? "as launched" : one.slice(one.lastIndexOf("/") + 1));
    const options = all.map((one) => create("option", { value: one, title: one, textContent: labelOf(one) }));
    select.replaceChildren(...options);
    select.value = now;
  }
}
