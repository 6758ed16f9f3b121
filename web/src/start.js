// The start page: where a visitor begins, and the way back to what was open last.
import { at } from "./dom.js";
import { keep, kept } from "./storage.js";

export class Start {
  // `go` has what each button does: tutorial, tasks, fly, build; `open(script)` opens the last script again.
  constructor(go, open) {
    const dialog = at("start-page");
    for (const button of dialog.querySelectorAll("[data-start]")) {
      button.onclick = () => {
        dialog.close();
        go[button.dataset.start]();
      };
    }
    at("go-on").onclick = () => {
      dialog.close();
      open(kept("script", ""));
    };
    dialog.onclick = (event) => event.target === dialog && dialog.close(); // beside it
    dialog.onclose = () => keep("started", true);
    at("start-close").onclick = () => dialog.close();
    at("home").onclick = () => this.show();
    if (!kept("started", false)) this.show();
  }

  show() {
    const last = kept("script", "");
    at("go-on").hidden = !last;
    at("go-on-name").textContent = last.split("/").pop();
    at("start-page").showModal();
  }

  // The page is served before the pictures are.
  load() {
    for (const picture of at("start-page").querySelectorAll("img[data-src]")) picture.src ||= picture.dataset.src;
  }
}
