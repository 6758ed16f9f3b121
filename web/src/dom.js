// Functions that find and create elements, and the icons of buttons (SVG paths in a 20 x 20 box; "!" marks a filled one).
const ICONS = {
  home: "M3 9.5 10 3.5l7 6M5 8.5V16h3.6v-4.2h2.8V16H15V8.5",
  play: "!M6 4v12l10-6z",
  pause: "!M5.5 4h3v12h-3zM11.5 4h3v12h-3z",
  step: "!M4 4v12l7.5-6zM13 4h3v12h-3z",
  restart: "M15.5 6.5A6.3 6.3 0 1 0 16.3 10M16.2 3.2v3.9h-3.9",
  stop: "!M5 5h10v10H5z",
  snapshot: "M6 3.5h8V17l-4-3.2L6 17z",
  restore: "M5 9V3.5h10V17l-5-3.2L5 17v-2.5M2 11.8h8M7.2 9l2.8 2.8-2.8 2.8",
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
  edit: "M9 3.2 15.5 6.5v3M9 3.2 2.5 6.5v7L9 16.8v-7M2.5 6.5 9 9.8l6.5-3.3M11.5 16.8l.6-2.6 4.6-4.6 2 2-4.6 4.6z",
  text: "M5 2.8h7l3.5 3.5v10.9H5zM12 2.8v3.5h3.5M7.5 9.5h5.5M7.5 12h5.5M7.5 14.5h3.5",
  undo: "M4 8h8a4 4 0 0 1 0 8H9M7.2 4.6 3.8 8l3.4 3.4",
  redo: "M16 8H8a4 4 0 0 0 0 8h3M12.8 4.6 16.2 8l-3.4 3.4",
  move: "M10 2.5v15M2.5 10h15M8 4.5l2-2 2 2M8 15.5l2 2 2-2M4.5 8l-2 2 2 2M15.5 8l2 2-2 2",
  turn: "M16.3 11.5A6.5 6.5 0 1 1 14.6 5.3M15 2v3.6h-3.6",
  resize: "M3.5 10.5v6h6v-6zM11 3.5h5.5V9M16.5 3.5 10 10",
  grid: "M3.5 3.5h13v13h-13zM7.8 3.5v13M12.2 3.5v13M3.5 7.8h13M3.5 12.2h13",
  drop: "M6.5 2.5h7v6h-7zM10 10v4.5M8 12.7l2 2 2-2M3 17.3h14",
  measure: "M2.5 13 13 2.5 17.5 7 7 17.5zM5.5 10.5l1.8 1.8M8 8l1.8 1.8M10.5 5.5l1.8 1.8",
  add: "M10 4v12M4 10h12",
  cube: "M10 2.8 16.5 6.3v7.4L10 17.2l-6.5-3.5V6.3zM3.5 6.3 10 9.8l6.5-3.5M10 9.8v7.4",
  ball: "M10 17a7 7 0 1 0 0-14 7 7 0 0 0 0 14M3.2 10.8c2.6 2.6 11 2.6 13.6 0",
  cylinder: "M4.5 5.5c0-2.8 11-2.8 11 0s-11 2.8-11 0v9c0 2.8 11 2.8 11 0v-9",
  cone: "M10 2.8 4.5 14.8c0 2.7 11 2.7 11 0z",
  mesh: "M10 2.8 17.3 16H2.7zM6.3 9.5h7.4M10 16 6.3 9.5M10 16l3.7-6.5",
  group: "M2.8 8.5h8v8h-8zM8.5 5.5V3h8.7v8.7h-3.4",
  floor: "M1.8 11 10 6.5l8.2 4.5-8.2 4.5z",
  drone: "M6 6l8 8M14 6l-8 8M5 7.4a2.4 2.4 0 1 0 0-4.8 2.4 2.4 0 0 0 0 4.8M15 7.4a2.4 2.4 0 1 0 0-4.8 2.4 2.4 0 0 0 0 4.8M5 17.4a2.4 2.4 0 1 0 0-4.8 2.4 2.4 0 0 0 0 4.8M15 17.4a2.4 2.4 0 1 0 0-4.8 2.4 2.4 0 0 0 0 4.8",
  dummy: "M9 11V3M9 11l7.5 3M9 11l-5.5 5M7.5 4.5 9 3l1.5 1.5",
  proximity: "M3.5 10 15 4.5v11zM15 4.5c2.6 3.4 2.6 7.6 0 11",
  joint: "M10 2.5v15M4 10c0-3.2 12-3.2 12 0s-12 3.2-12 0",
  force: "M4 16 15.5 4.5M10 4h6v6M4 11v5h5",
  path: "M3 15.5c3.5-13 9 5 14-10.5",
  part: "M6 6h8v8H6z",
  large: "M11.5 3.5h5v5M16.5 3.5l-6 6M8.5 16.5h-5v-5M3.5 16.5l6-6",
};
const SVG = "http://www.w3.org/2000/svg";

/**
 * @template {keyof PageElements} Id
 * @param {Id} id
 */
export const at = (id) => /** @type {PageElements[Id]} */ (document.getElementById(id));

/**
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Record<string, any>} properties of the element, of any type; "role" and names with "-" are attributes
 * @param {(Node | string)[]} children
 */
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

// Return a button that has only an icon; `name` is its tooltip and its label for screen readers.
export function iconButton(picture, name, onclick) {
  return create("button", { className: "plain", title: name, "aria-label": name, type: "button", onclick }, icon(picture));
}

export function save(blob, name) {
  const address = URL.createObjectURL(blob);
  create("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// Return the time (UTC) in a form that file names allow.
export const stamp = () => new Date().toISOString().slice(0, 19).replace(/[T:]/g, "-");
