// The icons at the scene's edge, and the panel that they open. The browser stores which panel is open, its width and side.
import { at } from "./dom.js";
import { keep, kept } from "./storage.js";
import { split } from "./split.js";

export class Side {
  constructor(onShow) {
    this.onShow = onShow; // called with the name of the open panel, "" for none
    this.buttons = [...document.querySelectorAll("#rail button[data-panel]")];
    for (const button of this.buttons) button.onclick = () => this.open(button.dataset.panel === this.now && at("panel").checkVisibility() ? "" : button.dataset.panel);
    at("fold-side").onclick = () => this.open("");
    at("other-side").onclick = () => this.place(this.isLeft ? "right" : "left");
    at("panel").addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      this.buttons.find((one) => one.dataset.panel === this.now)?.focus();
      this.open("");
    });
    split(at("side-edge"), "--side", "x", 240, () => Math.max(240, at("stage").clientWidth - 120), (event) => this.width(event));
    this.place(kept("side/place", "right"));
    this.open(kept("side/open", ""));
  }

  get isLeft() {
    return document.body.classList.contains("side-left");
  }

  width({ clientX }) {
    const box = at("panel").getBoundingClientRect();
    return this.isLeft ? clientX - box.left : box.right - clientX;
  }

  place(place) {
    document.body.classList.toggle("side-left", place === "left");
    keep("side/place", place);
  }

  open(name) {
    this.now = this.buttons.some((one) => one.dataset.panel === name) ? name : "";
    for (const button of this.buttons) {
      const is = button.dataset.panel === this.now;
      button.setAttribute("aria-expanded", String(is));
      at(/** @type {"edit-panel"} */ (`${button.dataset.panel}-panel`)).hidden = !is;
      if (is) at("panel-title").textContent = button.title;
    }
    at("panel").hidden = !this.now;
    document.body.classList.toggle("side-open", Boolean(this.now));
    keep("side/open", this.now);
    this.onShow(this.now);
  }
}
