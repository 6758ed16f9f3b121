// Projection of points of the world (m, x right, y forward, z up) to the screen.
"use strict";

const report = { flights: {} }; // filled by the files with figures

const VIEWS = {
  space: { azimuth: -2.2, elevation: 0.42, flat: false },
  top: { azimuth: -Math.PI / 2, elevation: Math.PI / 2, flat: true }, // x to the right, y up
  side: { azimuth: -Math.PI / 2, elevation: 0, flat: true }, // x to the right, z up
  follow: { azimuth: -2.2, elevation: 0.42, flat: false },
};
const LENS = 1.6; // distance of the eye divided by the visible width

class View {
  constructor() {
    this.target = [0, 0, 0];
    this.extent = 4; // m, visible width
    this.zoom = 1;
    this.show("space");
  }

  // Select one of VIEWS.
  show(name) {
    this.name = name;
    Object.assign(this, VIEWS[name]);
    this.zoom = 1;
  }

  // Rotate by angles (rad), except in the views from above and from the side.
  turn(azimuth, elevation) {
    if (this.flat) return;
    this.azimuth += azimuth;
    this.elevation = Math.min(1.5, Math.max(-0.1, this.elevation + elevation));
  }

  // Prepare a picture with a size in pixels.
  begin(width, height) {
    const [ca, sa, ce, se] = [this.azimuth, this.elevation].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
    this.right = [-sa, ca, 0];
    this.up = [-ca * se, -sa * se, ce];
    this.toward = [ca * ce, sa * ce, se];
    this.middle = [width / 2, height / 2];
    const seen = (this.extent * (this.name === "follow" ? 0.5 : 1)) / this.zoom;
    this.scale = Math.min(width, height) / seen; // px per m at the target
    this.eye = LENS * seen; // m, from the target
  }

  // Return [x, y, depth] of a point: px, and m in front of the eye; null for one behind it.
  project(point) {
    const v = point.map((value, axis) => value - this.target[axis]);
    const depth = this.eye - dot(this.toward, v);
    if (!this.flat && depth < 0.02 * this.eye) return null;
    const scale = this.flat ? this.scale : (this.scale * this.eye) / depth;
    return [this.middle[0] + scale * dot(this.right, v), this.middle[1] - scale * dot(this.up, v), depth];
  }

  // Return the pixels per metre at a point.
  size(point) {
    const seen = this.project(point);
    return !seen ? 0 : this.flat ? this.scale : (this.scale * this.eye) / seen[2];
  }
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Return a point of the body (m) in the world frame, with ROS's roll, pitch, yaw.
function turned(point, [roll, pitch, yaw]) {
  const [cr, sr, cp, sp, cy, sy] = [roll, pitch, yaw].flatMap((angle) => [Math.cos(angle), Math.sin(angle)]);
  const [x, y, z] = point;
  const [y1, z1] = [cr * y - sr * z, sr * y + cr * z];
  const [x2, z2] = [cp * x + sp * z1, cp * z1 - sp * x];
  return [cy * x2 - sy * y1, sy * x2 + cy * y1, z2];
}
