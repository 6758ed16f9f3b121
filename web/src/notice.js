// The message over the scene's lower edge. The store removes it after some seconds; an error stays until the next action,
// until a script has started, or until the user closes it.
import { at } from "./dom.js";

export class Notice {
  /** @param {import("./state/store.js").Store} store */
  constructor(store) {
    this.store = store;
    at("notice").querySelector("button")?.addEventListener("click", () => this.clear());
    at("notice").onkeydown = (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.clear();
    };
  }

  say(text, bad = false) {
    this.store.take("notice", { text, bad });
  }

  // Show a message, unless an error is shown.
  warn(text) {
    if (!this.store.now.notice?.bad) this.say(text);
  }

  clear() {
    this.say("");
  }
}
