// The drawing over a camera's picture: boxes with names, and a legend of the colors of its mask.
import { create, iconButton } from "./dom.js";

const SVG = "http://www.w3.org/2000/svg";
const READABLE = 11; // px on the screen, smallest font size of a name
const KINDS = { boxes: "Boxes around the objects in this picture", mask: "Mask: a color for each category in this picture" };

export class Overlay {
  // `turn(kind, on)` switches the boxes or the mask on or off.
  constructor(topic, turn) {
    this.svg = document.createElementNS(SVG, "svg");
    this.svg.setAttribute("class", "boxes-over");
    this.svg.setAttribute("preserveAspectRatio", "none");
    this.legend = create("p", { className: "legend" });
    this.buttons = Object.entries(KINDS).map(([kind, title]) => {
      const isOn = () => button.getAttribute("aria-pressed") === "true";
      const button = iconButton(kind, title, () => turn(kind, !isOn()));
      button.setAttribute("aria-label", `${kind === "boxes" ? "Boxes over" : "Mask over"} ${topic}`);
      button.dataset.overlay = kind;
      button.hidden = true;
      return button;
    });
  }

  // Draw boxes and legend. `overlays` are the kinds that are on, undefined for a camera without ground truth.
  show({ overlays, boxes = [], legend = [], step = 1 }, image) {
    for (const one of this.buttons) {
      one.hidden = !overlays;
      one.setAttribute("aria-pressed", String(Boolean(overlays?.includes(one.dataset.overlay))));
    }
    const [width, height] = [image.naturalWidth * step, image.naturalHeight * step];
    this.svg.setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    const size = Math.max(width / 40, (READABLE * width) / (this.svg.clientWidth || width));
    this.svg.replaceChildren(...boxes.filter(({ box }) => Array.isArray(box)).flatMap((one) => boxElements(one, size)));
    this.legend.replaceChildren(...legend.map(({ name, color }) => {
      const patch = create("i");
      patch.style.background = color;
      return create("span", {}, patch, name);
    }));
  }
}

function boxElements({ name, box, color }, size) {
  const [left, top, right, bottom] = box;
  const rect = svgElement("rect", { x: left, y: top, width: right - left, height: bottom - top, stroke: color });
  const text = svgElement("text", { x: left, y: Math.max(top - size / 4, size), fill: color, "font-size": size });
  text.textContent = name;
  return [rect, text];
}

function svgElement(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}
