// Plots over time: states, commands (dashed), failed criteria, and the time of the replay.
"use strict";

const SVG = "http://www.w3.org/2000/svg";
const COLOURS = ["#c0392b", "#2c8a57", "#1f5fa8", "#8a5a9e"];
const PANELS = [
  { title: "place [m]", lines: ["x", "y", "z"] },
  { title: "velocity, track frame [m/s]", lines: ["vx", "vy", "vz"], commanded: ["command_vx", "command_vy", "command_vz"] },
  { title: "attitude [rad]", lines: ["roll", "pitch", "yaw"] },
  { title: "yaw rate [rad/s]", lines: ["wz"], commanded: ["command_wz"] },
  { title: "propellers [m/s]", lines: ["propeller1", "propeller2", "propeller3", "propeller4"] },
];
const [HIGH, LEFT, BOTTOM] = [104, 38, 17]; // px: height of a plot, space for the numbers

class Plots {
  // `seek` is called with the time (s) under the mouse.
  constructor(place, seek) {
    this.place = place;
    this.seek = seek;
    this.panels = [];
  }

  load(flight) {
    this.flight = flight;
    this.end = flight.t[flight.t.length - 1] || 1;
    this.wide = Math.max(300, this.place.clientWidth - 22); // px
    this.place.replaceChildren();
    this.panels = PANELS.map((panel) => this.panel(panel));
    this.show(0);
  }

  // Show a time (s).
  show(time) {
    const row = this.panels.length ? rowAt(this.flight.t, time) : 0;
    for (const panel of this.panels) {
      const x = this.x(time);
      panel.cursor.setAttribute("d", `M${x} 0V${HIGH - BOTTOM}`);
      panel.values.forEach((value, line) => {
        value.textContent = `${panel.lines[line].replace("propeller", "")} ${this.flight[panel.lines[line]][row].toFixed(2)}`;
      });
    }
  }

  x(time) {
    return LEFT + ((this.wide - LEFT) * time) / this.end;
  }

  panel({ title, lines, commanded = [] }) {
    const figure = this.place.appendChild(document.createElement("figure"));
    const caption = figure.appendChild(document.createElement("figcaption"));
    caption.appendChild(document.createElement("b")).textContent = title;
    const svg = figure.appendChild(drawn("svg", { viewBox: `0 0 ${this.wide} ${HIGH}` }));
    const [low, high] = range([...lines, ...commanded].map((name) => this.flight[name]));
    const y = (value) => ((HIGH - BOTTOM) * (high - value)) / (high - low);
    this.axes(svg, low, high, y);
    commanded.forEach((name, line) => this.line(svg, this.steps(name, y), COLOURS[line], "3 3"));
    lines.forEach((name, line) => this.line(svg, this.curve(name, y), COLOURS[line], "none"));
    for (const mark of this.flight.marks) {
      const path = drawn("path", { d: `M${this.x(mark.at)} 0V${HIGH - BOTTOM}`, stroke: COLOURS[0], "stroke-width": 2, opacity: 0.55 });
      path.appendChild(drawn("title", {})).textContent = `${mark.name} failed at ${mark.at.toFixed(2)} s`;
      svg.appendChild(path);
    }
    const cursor = svg.appendChild(drawn("path", { stroke: "#1d2733", "stroke-width": 1 }));
    const values = lines.map((_, line) => {
      const value = caption.appendChild(document.createElement("span"));
      value.style.color = COLOURS[line];
      return value;
    });
    if (commanded.length) caption.appendChild(document.createElement("small")).textContent = "dashed: commanded";
    this.follow(svg);
    return { cursor, values, lines };
  }

  axes(svg, low, high, y) {
    for (const value of ticks(low, high, 4)) {
      svg.appendChild(drawn("path", { d: `M${LEFT} ${y(value)}H${this.wide}`, stroke: "#e8ecf0" }));
      label(svg, LEFT - 5, y(value) + 4, "end", value);
    }
    for (const value of ticks(0, this.end, 8)) {
      const path = { d: `M${this.x(value)} 0V${HIGH - BOTTOM}`, stroke: "#f0f3f6" };
      svg.appendChild(drawn("path", path));
      label(svg, this.x(value), HIGH - 4, value > 0.95 * this.end ? "end" : "middle", value);
    }
  }

  curve(name, y) {
    const { t } = this.flight;
    return this.flight[name].map((value, row) => `${row ? "L" : "M"}${this.x(t[row]).toFixed(2)} ${y(value).toFixed(2)}`).join("");
  }

  // A command is in force during the step that ends at the time of its row.
  steps(name, y) {
    const { t } = this.flight;
    const parts = this.flight[name].map((value, row) => `V${y(value).toFixed(2)}H${this.x(t[row]).toFixed(2)}`);
    return `M${this.x(t[0]).toFixed(2)} ${y(this.flight[name][0]).toFixed(2)}${parts.join("")}`;
  }

  line(svg, d, colour, dashes) {
    svg.appendChild(drawn("path", { d, fill: "none", stroke: colour, "stroke-width": 1.4, "stroke-dasharray": dashes }));
  }

  follow(svg) {
    const point = (event) => {
      const box = svg.getBoundingClientRect();
      const x = ((event.clientX - box.left) / box.width) * this.wide;
      this.seek(Math.min(this.end, Math.max(0, ((x - LEFT) / (this.wide - LEFT)) * this.end)));
    };
    svg.addEventListener("pointerdown", (event) => {
      svg.setPointerCapture(event.pointerId);
      point(event);
    });
    svg.addEventListener("pointermove", (event) => event.buttons && point(event));
  }
}

function drawn(kind, attributes) {
  const element = document.createElementNS(SVG, kind);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

function label(svg, x, y, anchor, value) {
  svg.appendChild(drawn("text", { x, y, "text-anchor": anchor })).textContent = String(Number(value.toPrecision(6)));
}

// Return the range of an axis for some columns, at least a tenth of a unit.
function range(columns) {
  const values = columns.flat();
  let [low, high] = values.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]);
  const room = Math.max(0.1 - (high - low), 0) / 2 + 0.04 * (high - low);
  return [low - room, high + room];
}

function ticks(low, high, most) {
  const rough = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((one) => one * power >= rough);
  const found = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) found.push(k * step);
  return found;
}
