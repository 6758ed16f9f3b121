// Elements, and the pictures on buttons.
const ICONS = {
  home: "M3 9.5 10 3.5l7 6M5 8.5V16h3.6v-4.2h2.8V16H15V8.5",
  play: "!M6 4v12l10-6z",
  pause: "!M5.5 4h3v12h-3zM11.5 4h3v12h-3z",
  step: "!M4 4v12l7.5-6zM13 4h3v12h-3z",
  restart: "M15.5 6.5A6.3 6.3 0 1 0 16.3 10M16.2 3.2v3.9h-3.9",
  stop: "!M5 5h10v10H5z",
  snapshot: "M6 3.5h8V17l-4-3.2L6 17z",
  restore: "M4 8h8a4 4 0 0 1 0 8H8M7.2 4.6 3.8 8l3.4 3.4",
  takeoff: "M10 12.5V3.5M6.2 7 10 3.2 13.8 7M4 16.5h12",
  reset: "M10 3.5v4M7.5 6 10 8.5 12.5 6M4 12.5h12M6 16.5h8",
  land: "M10 3.5v9M6.2 9 10 12.8 13.8 9M4 16.5h12",
  back: "M10 3a5 5 0 0 1 5 5c0 3.6-5 9-5 9S5 11.6 5 8a5 5 0 0 1 5-5zM10 9.6a1.7 1.7 0 1 0 0-3.4 1.7 1.7 0 0 0 0 3.4",
  photo: "M3 6.5h3l1.4-2h5.2l1.4 2h3V16H3zM10 13.5a2.7 2.7 0 1 0 0-5.4 2.7 2.7 0 0 0 0 5.4",
  video: "M2.5 6h10v8h-10zM12.5 9l5-2.7v7.4l-5-2.7",
  view: "M1.8 10S4.8 4.8 10 4.8 18.2 10 18.2 10 15.2 15.2 10 15.2 1.8 10 1.8 10zM10 12.6a2.6 2.6 0 1 0 0-5.2 2.6 2.6 0 0 0 0 5.2",
  cameras: "M3 5h14v8.5H3zM7 17h6M10 13.5V17",
  plots: "M3 3v14h14M5.5 12.5l3.2-4 2.8 2.3 4.5-6",
  tune: "M5 3v6M5 13v4M10 3v2M10 9v8M15 3v8M15 15v2M3 11h4M8 7h4M13 13h4",
  log: "M4 4.5h12M4 8.2h12M4 11.9h8M4 15.6h10",
  script: "M7 6 3 10l4 4M13 6l4 4-4 4",
  boxes: "M3.5 6V3.5H6M14 3.5h2.5V6M16.5 14v2.5H14M6 16.5H3.5V14M7 7h6v6H7z",
  mask: "!M10 3c4 0 6.5 2.4 6.5 6.2 0 2-1.4 3.1-3.3 3.1-1.6 0-1.9 1.1-1.3 2.3.6 1.3-.1 2.4-1.9 2.4C6.3 17 3.5 14 3.5 10S6.2 3 10 3z",
  help: "M7.2 7.3a2.8 2.8 0 1 1 4.3 2.3c-1 .7-1.5 1.2-1.5 2.4M10 15v.3",
  more: "!M4 8.5h3v3H4zM8.5 8.5h3v3h-3zM13 8.5h3v3h-3z",
  close: "M5 5l10 10M15 5 5 15",
  side: "M3 4.5h14v11H3zM12.5 4.5v11",
  large: "M11.5 3.5h5v5M16.5 3.5l-6 6M8.5 16.5h-5v-5M3.5 16.5l6-6",
};
const SVG = "http://www.w3.org/2000/svg";

export const at = (id) => document.getElementById(id);

export function create(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (name.includes("-") || name === "role") element.setAttribute(name, value);
    else element[name] = value;
  }
  element.append(...children);
  return element;
}

export function icon(name) {
  const svg = document.createElementNS(SVG, "svg");
  const path = document.createElementNS(SVG, "path");
  const filled = ICONS[name].startsWith("!");
  svg.setAttribute("viewBox", "0 0 20 20");
  svg.setAttribute("aria-hidden", "true");
  svg.setAttribute("class", filled ? "icon filled" : "icon");
  path.setAttribute("d", filled ? ICONS[name].slice(1) : ICONS[name]);
  svg.append(path);
  return svg;
}

// A button with a picture alone: its name is what a pointer, and a screen reader, is told.
export function iconButton(picture, name, onclick) {
  return create("button", { className: "plain", title: name, "aria-label": name, type: "button", onclick }, icon(picture));
}

export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  create("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// A time that a file's name can have.
export const stamp = () => new Date().toISOString().slice(0, 19).replace(/[T:]/g, "-");
