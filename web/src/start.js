// The start page: buttons for the first steps, the gallery of tasks, and a button that opens the last script again.
import { at, create } from "./dom.js";
import { isWatching } from "./course.js";
import { bestWords } from "./graded.js";
import { keep, kept } from "./storage.js";

const QUESTION = "A quadricopter, its script, and you. Where do you begin?";

export class Start {
  // `go` has an action for each button: tutorial, fly, build. `gallery` has list(), which returns the tasks, the easiest
  // first, and take(lesson, byKey), which starts one. `open(script)` opens the last script again.
  constructor(go, gallery, open) {
    const dialog = at("start-page");
    this.gallery = gallery;
    for (const button of dialog.querySelectorAll("[data-start]")) {
      button.onclick = () => {
        if (button.dataset.start === "tasks") return this.showTasks(true);
        dialog.close();
        go[button.dataset.start ?? ""]();
      };
    }
    at("gallery-back").onclick = () => this.showTasks(false);
    at("go-on").onclick = () => {
      dialog.close();
      open(kept("script", ""));
    };
    dialog.onclick = (event) => event.target === dialog && dialog.close(); // a click on the backdrop
    dialog.onclose = () => keep("started", true);
    at("start-close").onclick = () => dialog.close();
    at("home").onclick = () => this.show();
    if (!isWatching && !kept("started", false)) this.show();
  }

  showTasks(on) {
    at("gallery").hidden = !on;
    at("start-choices").hidden = on;
    at("start-question").textContent = on ? "Which task? The easiest come first." : QUESTION;
    if (!on) return;
    at("gallery-tasks").replaceChildren(...this.gallery.list().map((one) => this.card(one)));
    at("gallery-tasks").firstElementChild?.focus();
  }

  card({ lesson, title, summary, difficulty, time }) {
    const best = bestWords(lesson);
    const begin = (event) => {
      at("start-page").close();
      this.gallery.take(lesson, event.detail === 0); // `detail` is 0 for a key press
    };
    return create(
      "button", { type: "button", onclick: begin },
      create("img", { src: `${lesson}/picture.png`, alt: "" }),
      create("b", {}, title),
      create("span", {}, summary),
      create("small", {}, [difficulty, time].filter(Boolean).join(" · ")),
      create("small", { className: best ? "best" : "" }, best ? `your best: ${best}` : "not graded yet"),
    );
  }

  show() {
    this.showTasks(false);
    const last = kept("script", "");
    at("go-on").hidden = !last;
    at("go-on-name").textContent = last.split("/").pop();
    at("start-page").showModal();
  }

  // Load the pictures, once the page is connected: the page is served before they are.
  load() {
    for (const picture of at("start-page").querySelectorAll("img")) picture.src ||= picture.dataset.src ?? "";
  }
}
