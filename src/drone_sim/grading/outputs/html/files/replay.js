// The replay: scene, path and drone on a canvas.
"use strict";

const ARM = 0.13; // m, from the center to a rotor
const SMALLEST = 15; // px, of an arm: a distant drone is drawn larger than it is
const FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]; // indices of corners
const INK = "#1d2733", PATH = "#1f5fa8", HUB = "#ff5a00", FAILED = "#c0392b", NOSE = "#ff8a3c";

class Replay {
  constructor(canvas) {
    this.canvas = canvas;
    this.view = new View();
    this.flight = null;
    this.time = 0;
  }

  // Load a flight and show its start.
  load(flight) {
    this.flight = flight;
    this.scene = flight.scene || report.scene;
    this.points = flight.t.map((_, row) => [flight.x[row], flight.y[row], flight.z[row]]);
    const [low, high] = bounds([...this.points, [0, 0, 0].map((_, axis) => (axis === 2 ? 0 : this.points[0][axis]))]);
    this.middle = low.map((value, axis) => (value + high[axis]) / 2);
    this.view.extent = 1.35 * Math.max(2, ...low.map((value, axis) => high[axis] - value));
    this.draw(0);
  }

  // Return position (m) and roll, pitch, yaw (rad) at a time (s).
  at(time) {
    const { t, roll, pitch, yaw } = this.flight;
    const row = rowAt(t, time);
    const next = Math.min(row + 1, t.length - 1);
    const part = next === row ? 0 : Math.min(1, Math.max(0, (time - t[row]) / (t[next] - t[row])));
    const place = this.points[row].map((value, axis) => value + part * (this.points[next][axis] - value));
    const angles = [roll, pitch, yaw].map((one) => one[row] + part * shortest(one[next] - one[row]));
    return { row, place, angles };
  }

  draw(time) {
    this.time = time;
    if (!this.flight) return;
    const { canvas, view } = this;
    const ratio = window.devicePixelRatio || 1;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    const pen = (this.pen = canvas.getContext("2d"));
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.fillStyle = "#fbfcfd";
    pen.fillRect(0, 0, width, height);
    const now = this.at(time);
    view.target = view.name === "follow" ? now.place : this.middle;
    view.begin(width, height);
    canvas.dataset.scale = view.scale;
    canvas.dataset.target = view.target.join(" ");
    this.drawFloor();
    this.drawBoxes();
    this.drawLine(this.points, "#9fb6d2", 1.2);
    this.drawLine([...this.points.slice(0, now.row + 1), now.place], PATH, 2.4);
    this.drawPlumbLine(now.place);
    for (const mark of this.flight.marks) this.drawMark(mark, time);
    this.drawDrone(now);
    this.drawAxes(height);
  }

  drawLine(points, colour, width) {
    const { pen, view } = this;
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    let hidden = true;
    for (const point of points) {
      const seen = view.project(point);
      if (seen) hidden ? pen.moveTo(seen[0], seen[1]) : pen.lineTo(seen[0], seen[1]);
      hidden = !seen;
    }
    pen.stroke();
  }

  drawFloor() {
    const half = Math.min(this.scene.floor / 2, 4 * this.view.extent);
    const step = [0.5, 1, 2, 5, 10, 50, 100, 1000].find((one) => half / one <= 30) || 5000;
    const [cx, cy] = this.scene.floor / 2 > half ? this.middle.map((one) => step * Math.round(one / step)) : [0, 0];
    const count = Math.floor(half / step);
    for (let line = -count; line <= count; line++) {
      const colour = line % 5 === 0 ? "#d3dae1" : "#e8ecf0";
      this.drawLine([[cx + line * step, cy - half, 0], [cx + line * step, cy + half, 0]], colour, 1);
      this.drawLine([[cx - half, cy + line * step, 0], [cx + half, cy + line * step, 0]], colour, 1);
    }
    const edge = [[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]].map(([x, y]) => [cx + x * half, cy + y * half, 0]);
    this.drawLine(edge, "#c3ccd5", 1);
  }

  drawBoxes() {
    const faces = [];
    for (const box of this.scene.boxes) {
      const seen = box.corners.map((corner) => this.view.project(corner));
      if (seen.includes(null)) continue;
      for (const [index, face] of FACES.entries()) {
        const corners = face.map((corner) => seen[corner]);
        faces.push({ corners, depth: corners.reduce((sum, one) => sum + one[2], 0), colour: shade(box.color, index) });
      }
    }
    faces.sort((a, b) => b.depth - a.depth);
    const { pen } = this;
    pen.lineWidth = 0.7;
    pen.lineJoin = "round";
    for (const { corners, colour } of faces) {
      pen.beginPath();
      for (const [x, y] of corners) pen.lineTo(x, y);
      pen.closePath();
      pen.fillStyle = colour;
      pen.strokeStyle = "#00000026";
      pen.fill();
      pen.stroke();
    }
  }

  drawPlumbLine(place) {
    const { pen } = this;
    pen.setLineDash([3, 4]);
    this.drawLine([place, [place[0], place[1], 0]], "#8894a0", 1);
    pen.setLineDash([]);
  }

  drawMark(mark, time) {
    const seen = this.view.project(this.at(mark.at).place);
    if (!seen) return;
    const { pen } = this;
    const [x, y] = seen;
    pen.strokeStyle = FAILED;
    pen.lineWidth = 2.5;
    pen.beginPath();
    for (const side of [-5, 5]) {
      pen.moveTo(x - 5, y - side);
      pen.lineTo(x + 5, y + side);
    }
    pen.stroke();
    if (time < mark.at) return;
    pen.fillStyle = FAILED;
    pen.font = "600 12px system-ui, sans-serif";
    pen.lineWidth = 3;
    pen.strokeStyle = "#ffffffd0";
    pen.strokeText(mark.name, x + 9, y - 9);
    pen.fillText(mark.name, x + 9, y - 9);
  }

  // Draw a cross with rotors, and an arrow at its front.
  drawDrone({ place, angles }) {
    const { pen, view } = this;
    const metre = view.size(place);
    if (!metre) return;
    const size = Math.max(1, SMALLEST / (ARM * metre));
    const on = (point) => view.project(turned(point.map((one) => one * size), angles).map((one, axis) => one + place[axis]));
    const arm = ARM * Math.SQRT1_2;
    const rotors = [[arm, arm], [-arm, -arm], [arm, -arm], [-arm, arm]];
    this.stroke([on([arm, arm, 0]), on([-arm, -arm, 0])], INK, 3);
    this.stroke([on([arm, -arm, 0]), on([-arm, arm, 0])], INK, 3);
    for (const [x, y] of rotors) {
      const rim = Array.from({ length: 21 }, (_, k) => (k * Math.PI) / 10);
      this.stroke(rim.map((a) => on([x + 0.07 * Math.cos(a), y + 0.07 * Math.sin(a), 0.015])), x > 0 ? "#d9730d" : "#51606f", 1.6);
    }
    this.stroke([on([0, 0, 0]), on([0.2, 0, 0])], NOSE, 2.4);
    this.stroke([on([0.16, 0.03, 0]), on([0.2, 0, 0]), on([0.16, -0.03, 0])], NOSE, 2.4);
    const [x, y] = view.project(place);
    pen.fillStyle = HUB;
    pen.beginPath();
    pen.arc(x, y, 4, 0, 2 * Math.PI);
    pen.fill();
  }

  stroke(seen, colour, width) {
    if (seen.includes(null)) return;
    const { pen } = this;
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.beginPath();
    for (const [x, y] of seen) pen.lineTo(x, y);
    pen.stroke();
  }

  drawAxes(height) {
    const { pen, view } = this;
    pen.font = "12px system-ui, sans-serif";
    for (const [axis, colour] of [[0, "#c0392b"], [1, "#2c8a57"], [2, "#1f5fa8"]]) {
      const [x, y] = [26 * view.right[axis], -26 * view.up[axis]];
      if (Math.hypot(x, y) < 4) continue;
      this.stroke([[34, height - 34], [34 + x, height - 34 + y]], colour, 2);
      pen.fillStyle = colour;
      pen.fillText("xyz"[axis], 31 + 1.35 * x, height - 30 + 1.35 * y);
    }
  }
}

// Return the last row at or before a time.
function rowAt(t, time) {
  let [low, high] = [0, t.length - 1];
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    t[middle] <= time + 1e-9 ? (low = middle) : (high = middle - 1);
  }
  return low;
}

function shortest(turn) {
  return turn - 2 * Math.PI * Math.round(turn / (2 * Math.PI));
}

function bounds(points) {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const point of points) {
    for (let axis = 0; axis < 3; axis++) {
      low[axis] = Math.min(low[axis], point[axis]);
      high[axis] = Math.max(high[axis], point[axis]);
    }
  }
  return [low, high];
}

function shade(color, face) {
  const light = [0.75, 1, 0.85, 0.85, 0.92, 0.92][face];
  return `rgb(${color.map((one) => Math.round(255 * light * one)).join(" ")} / 0.82)`;
}
