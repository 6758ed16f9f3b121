// What a marker looks like: the kinds that rviz knows, and handles, which are nothing but a place.
import * as THREE from "three";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { SHAPES, SUNLIT, dispose, isFloor, material } from "./looks.js";
import { load } from "./meshes.js";
import { Words } from "./text.js";
import { FOV } from "./view.js";

const LABEL = 13; // px of the words on the drone's state
const THINNEST = 0.002; // m
const ABOUT = 2; // px, of lines about the drone: from close behind, one in metres would hide what it is about
const TARGETS = "markers"; // the green spheres, in which a drone may be
const CLEAR = 0.45;
const FEW = 1000; // numbers, of a shape that is kept for others like it
const MOST = 200; // such shapes
const known = new Map();
const up = new THREE.Vector3(0, 0, 1);

// Returns an object for what is said of a marker; `changed` is called when a part of it comes later.
export function make(said, changed) {
  if (said.layer === TARGETS && said.color) said = { ...said, color: [...said.color.slice(0, 3), CLEAR] };
  const object = (KINDS[said.kind] ?? nothing)(said, changed);
  object.userData.said = said;
  return object;
}

// Gives an object another look of the same kind; tells whether that was possible.
export function change(object, said) {
  const before = object.userData.said;
  if (said.kind !== "text" || before.kind !== "text" || said.frame !== before.frame || !object.isSprite) return false;
  object.say(said.text);
  object.userData.said = said;
  return true;
}

const nothing = () => new THREE.Group();

function solid(shape) {
  return ({ color, scale, lit }) => {
    const group = new THREE.Group(); // the pose is the group's, the size is the mesh's
    const mesh = new THREE.Mesh(SHAPES[shape], material(color, lit));
    mesh.scale.fromArray(scale.map((one) => one || 1e-6));
    return group.add(shade(mesh, color[3]));
  };
}

function shade(mesh, alpha = 1) {
  mesh.castShadow = mesh.receiveShadow = alpha >= 1;
  return mesh;
}

function arrow({ color, scale, points }) {
  const group = new THREE.Group();
  const [start, tip] = points ? [new THREE.Vector3(...points.slice(0, 3)), new THREE.Vector3(...points.slice(3, 6))] : [new THREE.Vector3(), new THREE.Vector3(scale[0], 0, 0)];
  const way = tip.clone().sub(start);
  const length = way.length();
  if (!length) return group;
  const head = Math.min(length, points ? scale[2] || 0.23 * length : 0.23 * length);
  const [thin, wide] = points ? scale : [scale[1], 2 * scale[1]];
  const paint = material(color);
  const shaft = new THREE.Mesh(SHAPES.cylinder, paint);
  shaft.scale.set(thin, thin, length - head);
  shaft.position.z = (length - head) / 2;
  const cone = new THREE.Mesh(SHAPES.cone, paint);
  cone.scale.set(wide, wide, head);
  cone.position.z = length - head / 2;
  const inner = new THREE.Group().add(shaft, cone);
  inner.position.copy(start);
  inner.quaternion.setFromUnitVectors(up, way.normalize());
  return group.add(inner);
}

function lines({ kind, color, scale, points, colors, layer }) {
  const ends = kind === "strip" ? pairs(points, 3) : points.subarray(0, 6 * Math.floor(points.length / 6));
  const shades = colors && (kind === "strip" ? pairs(colors, 4) : colors);
  const geometry = new LineSegmentsGeometry().setPositions(ends);
  if (shades) geometry.setColors(shades.filter((_, number) => number % 4 !== 3));
  const width = layer.startsWith("view/") ? { linewidth: ABOUT } : { worldUnits: true, linewidth: Math.max(scale[0], THINNEST) };
  const look = shades ? { vertexColors: true } : { color: new THREE.Color(...color.slice(0, 3)) };
  const made = new LineSegments2(geometry, new LineMaterial({ ...width, ...look, opacity: color[3], transparent: color[3] < 1 }));
  made.raycast = () => {};
  return made;
}

// Each point with the one after it.
function pairs(points, size) {
  const count = points.length / size - 1;
  const made = new Float32Array(2 * size * count);
  for (let one = 0; one < count; one++) made.set(points.subarray(size * one, size * (one + 2)), 2 * size * one);
  return made;
}

function many(shape) {
  return ({ color, scale, points, colors }) => {
    const count = points.length / 3;
    const mesh = new THREE.InstancedMesh(SHAPES[shape], material(colors ? [1, 1, 1, color[3]] : color), count);
    const [x, y, z] = scale.map((one) => one || 1e-6);
    const matrix = new THREE.Matrix4().makeScale(x, y, z);
    const shadeOf = new THREE.Color();
    for (let one = 0; one < count; one++) {
      mesh.setMatrixAt(one, matrix.setPosition(points[3 * one], points[3 * one + 1], points[3 * one + 2]));
      if (colors) mesh.setColorAt(one, shadeOf.setRGB(colors[4 * one], colors[4 * one + 1], colors[4 * one + 2]));
    }
    return mesh;
  };
}

function dots({ color, scale, points, colors }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  if (colors) geometry.setAttribute("color", new THREE.BufferAttribute(colors, 4));
  // three counts the size as if the field of view were 90 degrees.
  const look = { size: Math.max(scale[0], THINNEST) / Math.tan(THREE.MathUtils.degToRad(FOV / 2)), vertexColors: Boolean(colors) };
  if (!colors) look.color = new THREE.Color(...color.slice(0, 3));
  return new THREE.Points(geometry, new THREE.PointsMaterial({ ...look, opacity: color[3], transparent: color[3] < 1 }));
}

function words({ text, color, scale, layer }) {
  const ink = `rgb(${color.slice(0, 3).map((one) => Math.round(255 * one)).join(" ")})`;
  const isLabel = layer.startsWith("view/"); // of the simulation's own: always as large as what else is to be read
  const made = new Words(text, { color: ink, size: isLabel ? LABEL : scale[2], fixed: isLabel, isLabel, plate: isLabel ? undefined : "" });
  return made;
}

function triangles({ color, scale, points, colors, lit }) {
  const mesh = colors ? painted(points, colors) : shade(new THREE.Mesh(facets(points), material(color, lit)), color[3]);
  mesh.scale.fromArray(scale.map((one) => one || 1));
  return new THREE.Group().add(mesh);
}

function painted(points, colors) {
  const geometry = corners(points);
  geometry.setAttribute("color", new THREE.BufferAttribute(colors, 4));
  const isClear = colors.some((one, number) => number % 4 === 3 && one < 1);
  const look = { vertexColors: true, transparent: isClear, depthWrite: !isClear, side: THREE.DoubleSide };
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(look));
}

// The simulation's boxes come as triangles, too: all of them have one shape, as large as their scale says.
function facets(points) {
  const name = points.length <= FEW ? points.join() : "";
  const geometry = known.get(name) ?? corners(points);
  if (!geometry.attributes.normal) geometry.computeVertexNormals();
  if (name && known.size < MOST) known.set(name, geometry);
  geometry.userData.shared = known.get(name) === geometry;
  return geometry;
}

function corners(points) {
  const count = 9 * Math.floor(points.length / 9);
  return new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(points.subarray(0, count), 3));
}

function mesh(said, changed) {
  const { mesh: address, own, color, scale } = said;
  const group = new THREE.Group();
  group.scale.fromArray(scale.map((one) => one || 1));
  const outer = new THREE.Group().add(group);
  load(address).then(
    (loaded) => {
      if (outer.userData.gone) return;
      const made = loaded.clone();
      made.traverse((one) => {
        if (!one.isMesh) return;
        if (!own) one.material = material(color);
        if (isFloor(said)) (one.material = one.material.clone()).color.multiply(SUNLIT);
        shade(one, one.material.opacity);
      });
      group.add(made);
      changed();
    },
    (error) => console.warn(`${address}: ${error.message}`),
  );
  return outer;
}

export function remove(object) {
  object.userData.gone = true;
  object.removeFromParent();
  dispose(object);
}

const KINDS = {
  cube: solid("cube"), sphere: solid("sphere"), cylinder: solid("cylinder"), arrow, strip: lines, lines,
  cubes: many("cube"), spheres: many("coarse"), points: dots, text: words, triangles, mesh,
};
