// The view panel: viewpoint, visible aids and selected object of the scene. The scene stores viewpoint and visible aids.
import { at, create } from "./dom.js";
import { keep, kept } from "./storage.js";

const SHOWN = {
  frames: ["Frames", "The axes of all frames: x red, y green, z blue"],
  path: ["Path flown", "Where the drone has been"],
  command: ["Command", "The way that is commanded, in a second"],
  forces: ["Forces", "Thrust, wind and contacts, as arrows"],
  handles: ["Handles", "The arrows that drag what is selected"],
  shadows: ["Shadows", "Off at first where the browser has no GPU"],
  marks: ["Metre marks", "The axes x and y on the floor, with their metres"],
  labels: ["Labels", "What the drone does, in words above it"],
};
const WORDS = { behind: "Behind the drone", free: "Free", track: "tracking" };

// Return the label of a view: "front" for the camera frame drone/front_optical.
const labelOf = (view) => {
  const name = view.split("/").pop().replace(/_optical$/, "");
  return WORDS[name] ?? name;
};

export class View {
  /** @param {import("./scene/scene.js").Scene} scene */
  constructor(scene) {
    this.scene = scene;
    at("shown").replaceChildren(...Object.entries(SHOWN).map(([name, [label, hint]]) => this.box(name, label, hint)));
    at("push").oninput = () => this.push(at("push").valueAsNumber);
    this.push(kept("push", 0.5));
    at("objects").onchange = () => scene.select(at("objects").value);
    at("objects").onpointerdown = () => this.list();
    at("objects").onfocus = () => this.list();
    scene.onSelect = () => this.list();
    scene.onViews = () => this.offer();
    scene.onLook = () => this.mark();
    this.offer();
  }

  box(name, label, hint) {
    const box = create("input", { type: "checkbox", checked: this.scene.shown[name] });
    box.onchange = () => this.scene.show({ [name]: box.checked });
    return create("label", { title: hint }, box, label);
  }

  push(strength) {
    this.scene.pushes = strength;
    at("push").value = strength;
    at("push-text").textContent = `${strength.toFixed(1)} N`;
    keep("push", strength);
  }

  offer() {
    const buttons = this.scene.views.map((view) => {
      const button = create("button", { type: "button", textContent: labelOf(view), title: view });
      button.dataset.view = view;
      button.onclick = () => this.scene.look(view);
      return button;
    });
    at("views").replaceChildren(...buttons);
    this.mark();
  }

  next() {
    const { views, view } = this.scene;
    this.scene.look(views[(views.indexOf(view.name) + 1) % views.length]);
  }

  mark() {
    for (const button of at("views").children) button.setAttribute("aria-pressed", String(button.dataset.view === this.scene.view.name));
  }

  list() {
    const { handles, selected } = this.scene;
    const names = [...(handles?.keys() ?? [])].map((one) => one.slice(one.indexOf(" ") + 1));
    const all = ["", ...new Set(selected ? [...names, selected] : names)];
    const now = [...at("objects").options].map((one) => one.value);
    if (String(now) !== String(all)) at("objects").replaceChildren(...all.map((one) => new Option(one || "none", one)));
    at("objects").value = selected;
  }
}
