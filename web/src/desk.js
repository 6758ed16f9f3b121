// The parts around the editor: the file menu, and the console and the variables below the script.
import { Console } from "./console.js";
import { Known } from "./completion.js";
import { at } from "./dom.js";
import { Files } from "./files.js";
import { split } from "./split.js";
import { consoleWords, pauseOf } from "./state/words.js";
import { Variables } from "./variables.js";

const AGAIN = 1000; // ms between two "inspect" requests
const page = Math.random().toString(36).slice(2); // a random name for this page in "inspect" requests

export class Desk {
  // `show` is the page's show(): it displays questions to the user.
  /**
   * @param {import("./socket.js").PageSocket} socket
   * @param {import("./state/store.js").Store} store
   */
  constructor(socket, store, show) {
    this.socket = socket;
    this.store = store;
    this.show = show;
    this.known = new Known();
    this.console = new Console(at("console"), (file, line) => this.goTo(file, line));
    this.variables = new Variables(at("variables-of"), at("variables-body"));
    this.pause = ""; // the pause that was shown last, as file:line:time
    at("late").onchange = () => this.console.showTime(at("late").checked);
    at("clear").onclick = () => this.console.clear();
    at("live").onchange = () => this.look();
    for (const tab of this.tabs) tab.onclick = () => this.choose(tab);
    at("below-tabs").onkeydown = (event) => this.key(event);
    at("fold-below").onclick = () => this.fold(!at("below").classList.contains("folded"));
    split(at("over-below"), "--below", "y", 60, () => at("editor").clientHeight * 0.6, (event) => at("below").getBoundingClientRect().bottom - event.clientY);
    setInterval(() => this.look(), AGAIN);
  }

  // Set the scripts and create the file menu. The constructor cannot, because Scripts needs `known`.
  serve(scripts) {
    this.scripts = scripts;
    const item = (name) => [name, at(/** @type {"file-as"} */ (`file-${name}`))];
    const items = Object.fromEntries(["new-python", "new-lua", "as", "rename", "duplicate", "download", "upload", "revert", "delete"].map(item));
    const parts = {
      more: at("more"), menu: at("menu"), form: at("as-form"), label: at("as-label"), name: at("name"), said: at("name-said"),
      cancel: at("as-cancel"), drop: at("editor"), pick: at("pick"), items,
    };
    new Files(parts, scripts, this.show);
    this.store.on((now) => this.follow(now));
  }

  // ---- the two tabs

  get tabs() {
    return [at("tab-console"), at("tab-variables")];
  }

  choose(tab) {
    for (const one of this.tabs) {
      one.setAttribute("aria-selected", String(one === tab));
      one.tabIndex = one === tab ? 0 : -1;
      at(/** @type {"variables"} */ (one.getAttribute("aria-controls"))).hidden = one !== tab;
    }
    at("below").dataset.shows = tab.id;
    this.fold(false);
    this.look();
  }

  key(event) {
    if (!["ArrowLeft", "ArrowRight"].includes(event.key) || !this.tabs.includes(event.target)) return;
    const other = this.tabs.find((one) => one !== event.target);
    this.choose(other);
    other?.focus();
    event.stopPropagation();
  }

  fold(on) {
    at("below").classList.toggle("folded", on);
    at("fold-below").setAttribute("aria-expanded", String(!on));
    this.look();
  }

  // ---- between the cockpit and the editor

  async connected() {
    if (!this.known.modules.size) this.known.take(await this.socket.ask("api"));
    await this.look();
  }

  // Report the breakpoints and whether the variables are visible, and get the names for completion.
  async look() {
    if (!this.socket.open || !this.scripts) return;
    const { breakpoints } = this.scripts.editor;
    const looks = !document.hidden && !at("below").classList.contains("folded") && at("below").dataset.shows === "tab-variables";
    if (document.hidden && !Object.keys(breakpoints).length) return;
    const { objects, parameters } = await this.socket.ask("inspect", { page, breakpoints, looks, live: looks && at("live").checked }).catch(() => this.known.names);
    this.known.names = { objects, parameters };
  }

  // Show the variables of the scripts; null means that the simulation no longer sends them.
  take(state) {
    if (state) this.variables.take(state, this.scripts.is.file);
    else this.variables.clear();
    this.store.take("variables", state);
  }

  // Show the error that keeps a script from starting, and the line of a breakpoint when the flight pauses there.
  follow(now) {
    if (this.console.showCurrent(consoleWords(now))) this.choose(at("tab-console"));
    const pause = pauseOf(now);
    const name = pause ? `${pause.file}:${pause.line}:${pause.time}` : "";
    this.variables.say(now);
    if (name === this.pause) return;
    this.pause = name;
    if (!pause) return;
    this.choose(at("tab-variables"));
    const isOurs = pause.file === this.scripts.is.file || Object.keys(this.scripts.editor.breakpoints).length > 0;
    if (isOurs) this.goTo(pause.file, pause.line); // otherwise another browser has set the breakpoint
  }

  goTo(file, line) {
    return this.scripts.goTo(file, line).catch((error) => this.store.say("trouble", error.message));
  }
}
