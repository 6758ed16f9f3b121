// What is drawn over a camera's picture: boxes with names, and a legend of the colors of its mask.
import { create, iconButton } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";
const READABLE = 11; // px of the page, of a name
const KINDS = { boxes: "Boxes around the objects in this picture", mask: "Mask: a color for each category in this picture" };

export class Overlay {
  // `turn(kind, on)` asks for boxes or the mask.
  constructor(topic, turn) {
    this.svg = document.createElementNS(SVG, "svg");
    this.svg.setAttribute("class", "boxes-over");
    this.svg.setAttribute("preserveAspectRatio", "none");
    this.legend = create("p", { className: "legend" });
    this.buttons = Object.entries(KINDS).map(([kind, title]) => {
      const is = () => made.getAttribute("aria-pressed") === "true";
      const made = iconButton(kind, title, () => turn(kind, !is()));
      made.setAttribute("aria-label", `${kind === "boxes" ? "Boxes over" : "Mask over"} ${topic}`);
      made.dataset.overlay = kind;
      made.hidden = true;
      return made;
    });
  }

  // `overlays` are those that are on; a camera without truth says nothing of them.
  show({ overlays, boxes = [], legend = [], step = 1 }, image) {
    for (const one of this.buttons) {
      one.hidden = !overlays;
      one.setAttribute("aria-pressed", String(Boolean(overlays?.includes(one.dataset.overlay))));
    }
    const [width, height] = [image.naturalWidth * step, image.naturalHeight * step];
    this.svg.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    const size = Math.max(width / 40, (READABLE * width) / (this.svg.clientWidth || width));
    this.svg.replaceChildren(...boxes.filter(({ box }) => Array.isArray(box)).flatMap((one) => drawn(one, size)));
    this.legend.replaceChildren(...legend.map(({ name, color }) => {
      const patch = create("i");
      patch.style.background = color;
      return create("span", {}, patch, name);
    }));
  }
}

function drawn({ name, box, color }, size) {
  const [left, top, right, bottom] = box;
  const rect = part("rect", { x: left, y: top, width: right - left, height: bottom - top, stroke: color });
  const text = part("text", { x: left, y: Math.max(top - size / 4, size), fill: color, "font-size": size });
  text.textContent = name;
  return [rect, text];
}

function part(tag, attributes) {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
}
