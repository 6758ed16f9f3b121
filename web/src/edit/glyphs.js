// Glyphs for objects without a body, in edit mode: three bars for a dummy, the view pyramid for a camera, the axis for a joint.
import * as THREE from "three";
import { ACCENT, INK, SHAPES, axes, material } from "../scene/looks.js";

const AXIS = [0.9, 0.35, 0.05, 1];
const BODY = [0.25, 0.28, 0.32, 1];
const EYE = 0.06; // m, size of a sensor's housing
const DEPTH = 0.25; // m, length of the pyramid of a camera
const DUMMY = 0.08; // m, least length of the bars

const edges = new THREE.LineBasicMaterial({ color: INK });
edges.userData.shared = true;

export class Glyphs {
  constructor(world) {
    this.group = new THREE.Group();
    world.add(this.group);
    this.there = new Map(); // glyphs by their object's handle: { made, looks }, where `looks` are the values that it depends on
  }

  get all() {
    return this.group.children;
  }

  get(handle) {
    return this.there.get(handle)?.made;
  }

  // Show the glyphs of `objects`, of those types that have one; `null` hides all.
  show(objects) {
    const wanted = new Map((objects ?? []).filter(({ type }) => type in KINDS).map((one) => [one.handle, one]));
    for (const [handle, { made }] of this.there) {
      if (wanted.has(handle)) continue;
      made.removeFromParent();
      this.there.delete(handle);
    }
    for (const one of wanted.values()) this.put(one);
  }

  put({ handle, name, type, matrix, values }) {
    const looks = JSON.stringify([type, name, values.fov, values.horizontal_fov, values.width, values.height, values.size, values.range, values.max_range, values.angle, values.type]);
    if (this.there.get(handle)?.looks !== looks) {
      this.there.get(handle)?.made.removeFromParent();
      const made = KINDS[type](values);
      made.userData.said = { ns: name, layer: "edit", handle, color: [0, 0, 0, 1] };
      made.matrixAutoUpdate = false;
      this.group.add(made);
      this.there.set(handle, { made, looks });
    }
    const { made } = this.there.get(handle);
    made.matrix.copy(matrix);
    made.matrixWorldNeedsUpdate = true;
  }
}

function box(size, color, place = [0, 0, 0]) {
  const mesh = new THREE.Mesh(SHAPES.cube, material(color));
  mesh.scale.fromArray(size);
  mesh.position.fromArray(place);
  return mesh;
}

function lines(points) {
  const geometry = new THREE.BufferGeometry().setFromPoints(points.map((one) => new THREE.Vector3(...one)));
  const result = new THREE.LineSegments(geometry, edges);
  result.raycast = () => {};
  return result;
}

function dummy({ size }) {
  const length = Math.max(DUMMY, (size ?? 0) * 4);
  const grip = new THREE.Mesh(SHAPES.sphere, material([0.85, 0.6, 0.1, 1]));
  grip.scale.setScalar(length / 4);
  return axes(length, length / 40).add(grip);
}

// The camera looks along z, with y up; `fov` (rad) is the angle along the larger side of its picture.
function camera({ fov = 1, width = 640, height = 480 }) {
  const larger = DEPTH * Math.tan(Math.min(fov, 2.6) / 2);
  const [x, y] = width >= height ? [larger, (larger * height) / width] : [(larger * width) / height, larger];
  const corners = [[x, y], [-x, y], [-x, -y], [x, -y]].map(([a, b]) => [a, b, DEPTH]);
  const rim = corners.flatMap((one, number) => [one, corners[(number + 1) % 4], [0, 0, 0], one]);
  const up = [[-x / 3, y * 1.1, DEPTH], [0, y * 1.5, DEPTH], [x / 3, y * 1.1, DEPTH]];
  rim.push(up[0], up[1], up[1], up[2]);
  return new THREE.Group().add(box([EYE, EYE, EYE], BODY, [0, 0, -EYE / 2]), lines(rim));
}

// A vehicle's camera has a horizontal angle instead.
function vehicleCamera({ horizontal_fov: fov, width, height }) {
  return camera({ fov: width < height ? 2 * Math.atan((Math.tan(fov / 2) * height) / width) : fov, width, height });
}

function proximity({ range = 1, angle = 0.3, type }) {
  const length = Math.min(range, 0.5);
  const radius = type === "ray" ? 0 : length * Math.tan(Math.min(angle, 2.6) / 2);
  const circle = [...Array(12).keys()].map((one) => [radius * Math.cos((one * Math.PI) / 6), radius * Math.sin((one * Math.PI) / 6), length]);
  const rim = circle.flatMap((one, number) => [one, circle[(number + 1) % 12]]);
  for (const one of circle.filter((_, number) => number % 3 === 0)) rim.push([0, 0, 0], one);
  return new THREE.Group().add(box([EYE, EYE, EYE / 2], [0.7, 0.2, 0.6, 1]), lines(rim));
}

function joint() {
  const axis = new THREE.Mesh(SHAPES.cylinder, material(AXIS));
  axis.scale.set(0.02, 0.02, 0.25);
  const ring = new THREE.Mesh(SHAPES.cylinder, material([...new THREE.Color(ACCENT).toArray(), 1]));
  ring.scale.set(0.06, 0.06, 0.05);
  return new THREE.Group().add(axis, ring);
}

const force = () => new THREE.Group().add(box([0.06, 0.06, 0.02], [0.2, 0.6, 0.3, 1]));

const range = ({ max_range: range }) => proximity({ range, type: "ray" }); // on a vehicle

const KINDS = { dummy, camera, vision_sensor: camera, vehicle_camera: vehicleCamera, proximity_sensor: proximity, range_sensor: range, joint, force_sensor: force };
