// The list of cameras, with a checkbox for each. The picture of a camera that is on floats over the scene.
import { at, create } from "./dom.js";

export class Cameras {
  /** @param {import("./board.js").Board} board */
  constructor(board, act) {
    this.act = act;
    this.on = new Set();
    board.on("cameras", (all) => this.offer(all));
  }

  offer(all) {
    const rows = all.map(({ topic, name }) => {
      const box = create("input", { type: "checkbox", checked: this.on.has(topic) });
      box.dataset.topic = topic;
      box.onchange = () => this.act("camera", { topic, on: box.checked });
      return create("label", { title: topic }, box, name);
    });
    at("camera-list").replaceChildren(...(rows.length ? rows : ["There is no camera."]));
  }

  show(topics) {
    this.on = new Set(topics);
    for (const box of at("camera-list").querySelectorAll("input")) box.checked = this.on.has(box.dataset.topic);
  }
}
