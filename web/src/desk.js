// What stands around the editor: the menu of files, and below it console and variables.
import { Console } from "./console.js";
import { Known } from "./completion.js";
import { at } from "./dom.js";
import { Files } from "./files.js";
import { split } from "./split.js";
import { consoleWords, pauseOf } from "./state/words.js";
import { Variables } from "./variables.js";

const AGAIN = 1000; // ms between two words to the node on what is looked at
const page = Math.random().toString(36).slice(2); // this page's name

export class Desk {
  // `socket` answers questions; `show` shows questions, as the page's.
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
    this.pause = ""; // the one that was shown last
    at("late").onchange = () => this.console.showTime(at("late").checked);
    at("clear").onclick = () => this.console.clear();
    at("live").onchange = () => this.look();
    for (const tab of this.tabs) tab.onclick = () => this.choose(tab);
    at("below-tabs").onkeydown = (event) => this.key(event);
    at("fold-below").onclick = () => this.fold(!at("below").classList.contains("folded"));
    split(at("over-below"), "--below", "y", 60, () => at("editor").clientHeight * 0.6, (event) => at("below").getBoundingClientRect().bottom - event.clientY);
    setInterval(() => this.look(), AGAIN);
  }

  // Takes the scripts, which need this one's `known` to be made.
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

  // ---- between the node and the editor

  async connected() {
    if (!this.known.modules.size) this.known.take(await this.socket.ask("api"));
    await this.look();
  }

  // Says what is looked at, and hears which names there are.
  async look() {
    if (!this.socket.open || !this.scripts) return;
    const { breakpoints } = this.scripts.editor;
    const looks = !document.hidden && !at("below").classList.contains("folded") && at("below").dataset.shows === "tab-variables";
    if (document.hidden && !Object.keys(breakpoints).length) return;
    const { objects, parameters } = await this.socket.ask("inspect", { page, breakpoints, looks, live: looks && at("live").checked }).catch(() => this.known.names);
    this.known.names = { objects, parameters };
  }

  // Shows what the scripts hold; null if the simulation does not tell it any more.
  take(state) {
    if (state) this.variables.take(state, this.scripts.is.file);
    else this.variables.clear();
    this.store.take("variables", state);
  }

  // Shows what keeps a script from flying, and the line of a breakpoint when the flight pauses there.
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
    if (isOurs) this.goTo(pause.file, pause.line); // or another browser has set it
  }

  goTo(file, line) {
    return this.scripts.goTo(file, line).catch((error) => this.store.say("trouble", error.message));
  }
}
