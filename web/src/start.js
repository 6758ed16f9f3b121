// The first thing that a visitor sees: three doors, and the way back to what was open last.
import { at } from "./dom.js";
import { keep, kept } from "./kept.js";

export class Start {
  // `go` has what each door does: tutorial, tasks, fly; `open(script)` goes on where one was.
  constructor(go, open) {
    const dialog = at("doors");
    for (const door of dialog.querySelectorAll("[data-door]")) {
      door.onclick = () => {
        dialog.close();
        go[door.dataset.door]();
      };
    }
    at("go-on").onclick = () => {
      dialog.close();
      open(kept("script", ""));
    };
    dialog.onclick = (event) => event.target === dialog && dialog.close(); // beside it
    dialog.onclose = () => keep("started", true);
    at("doors-close").onclick = () => dialog.close();
    at("home").onclick = () => this.show();
    if (!kept("started", false)) this.show();
  }

  show() {
    const last = kept("script", "");
    at("go-on").hidden = !last;
    at("go-on-name").textContent = last.split("/").pop();
    at("doors").showModal();
  }

  // The page is served before the pictures are.
  load() {
    for (const picture of at("doors").querySelectorAll("img[data-src]")) picture.src ||= picture.dataset.src;
  }
}
