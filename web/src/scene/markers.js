// three.js objects of markers: the kinds of rviz, and handles, which are only a pose.
import * as THREE from "three";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { SHAPES, SUNLIT, dispose, isFloor, material } from "./looks.js";
import { load } from "./meshes.js";
import { Words } from "./text.js";
import { FOV } from "./view.js";

const LABEL = 13; // px, font size of the texts on the drone's state
const MIN_WIDTH = 0.002; // m, of lines and points
const VIEW_WIDTH = 2; // px, of lines of the layers view/...: close to the camera, a width in metres would hide the drone
const TARGETS = "markers"; // layer of the green target spheres
const TARGET_ALPHA = 0.45; // shows a drone inside its sphere
const MAX_SHARED_SIZE = 1000; // numbers of a triangle list that is cached
const MAX_SHARED = 200; // cached triangle lists
const sharedGeometries = new Map();
const up = new THREE.Vector3(0, 0, 1);

// Return the object of a marker; `changed` is called when its mesh file has been loaded.
export function make(marker, changed) {
  if (marker.layer === TARGETS && marker.color) marker = { ...marker, color: [...marker.color.slice(0, 3), TARGET_ALPHA] };
  const object = (KINDS[marker.kind] ?? emptyGroup)(marker, changed);
  object.userData.said = marker;
  return object;
}

// Change an object's text in place; return whether that was possible: both markers must be texts in the same frame.
export function change(object, marker) {
  const before = object.userData.said;
  if (marker.kind !== "text" || before.kind !== "text" || marker.frame !== before.frame || !object.isSprite) return false;
  object.say(marker.text);
  object.userData.said = marker;
  return true;
}

const emptyGroup = () => new THREE.Group();

function solid(shape) {
  return ({ color, scale, lit }) => {
    const group = new THREE.Group(); // the group has the pose, the mesh has the size
    const mesh = new THREE.Mesh(SHAPES[shape], material(color, lit));
    mesh.scale.fromArray(scale.map((one) => one || 1e-6));
    return group.add(setShadows(mesh, color[3]));
  };
}

function setShadows(mesh, alpha = 1) {
  mesh.castShadow = mesh.receiveShadow = alpha >= 1;
  return mesh;
}

function arrow({ color, scale, points }) {
  const group = new THREE.Group();
  const [start, tip] = points ? [new THREE.Vector3(...points.slice(0, 3)), new THREE.Vector3(...points.slice(3, 6))] : [new THREE.Vector3(), new THREE.Vector3(scale[0], 0, 0)];
  const direction = tip.clone().sub(start);
  const length = direction.length();
  if (!length) return group;
  const head = Math.min(length, points ? scale[2] || 0.23 * length : 0.23 * length);
  const [shaftWidth, headWidth] = points ? scale : [scale[1], 2 * scale[1]];
  const paint = material(color);
  const shaft = new THREE.Mesh(SHAPES.cylinder, paint);
  shaft.scale.set(shaftWidth, shaftWidth, length - head);
  shaft.position.z = (length - head) / 2;
  const cone = new THREE.Mesh(SHAPES.cone, paint);
  cone.scale.set(headWidth, headWidth, head);
  cone.position.z = length - head / 2;
  const inner = new THREE.Group().add(shaft, cone);
  inner.position.copy(start);
  inner.quaternion.setFromUnitVectors(up, direction.normalize());
  return group.add(inner);
}

function lines({ kind, color, scale, points, colors, layer }) {
  const ends = kind === "strip" ? pairs(points, 3) : points.subarray(0, 6 * Math.floor(points.length / 6));
  const segmentColors = colors && (kind === "strip" ? pairs(colors, 4) : colors);
  const geometry = new LineSegmentsGeometry().setPositions(ends);
  if (segmentColors) geometry.setColors(segmentColors.filter((_, number) => number % 4 !== 3));
  const width = layer.startsWith("view/") ? { linewidth: VIEW_WIDTH } : { worldUnits: true, linewidth: Math.max(scale[0], MIN_WIDTH) };
  const options = segmentColors ? { vertexColors: true } : { color: new THREE.Color(...color.slice(0, 3)) };
  const result = new LineSegments2(geometry, new LineMaterial({ ...width, ...options, opacity: color[3], transparent: color[3] < 1 }));
  result.raycast = () => {};
  return result;
}

// Return each point, of `size` numbers, followed by its successor: the ends of a line strip's segments.
function pairs(points, size) {
  const count = points.length / size - 1;
  const result = new Float32Array(2 * size * count);
  for (let one = 0; one < count; one++) result.set(points.subarray(size * one, size * (one + 2)), 2 * size * one);
  return result;
}

function instanced(shape) {
  return ({ color, scale, points, colors }) => {
    const count = points.length / 3;
    const mesh = new THREE.InstancedMesh(SHAPES[shape], material(colors ? [1, 1, 1, color[3]] : color), count);
    const [x, y, z] = scale.map((one) => one || 1e-6);
    const matrix = new THREE.Matrix4().makeScale(x, y, z);
    const colorOf = new THREE.Color();
    for (let one = 0; one < count; one++) {
      mesh.setMatrixAt(one, matrix.setPosition(points[3 * one], points[3 * one + 1], points[3 * one + 2]));
      if (colors) mesh.setColorAt(one, colorOf.setRGB(colors[4 * one], colors[4 * one + 1], colors[4 * one + 2]));
    }
    return mesh;
  };
}

function dots({ color, scale, points, colors }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  if (colors) geometry.setAttribute("color", new THREE.BufferAttribute(colors, 4));
  // three.js computes the size of points for a field of view of 90 degrees.
  const options = { size: Math.max(scale[0], MIN_WIDTH) / Math.tan(THREE.MathUtils.degToRad(FOV / 2)), vertexColors: Boolean(colors) };
  if (!colors) options.color = new THREE.Color(...color.slice(0, 3));
  return new THREE.Points(geometry, new THREE.PointsMaterial({ ...options, opacity: color[3], transparent: color[3] < 1 }));
}

function words({ text, color, scale, layer }) {
  const cssColor = `rgb(${color.slice(0, 3).map((one) => Math.round(255 * one)).join(" ")})`;
  const isLabel = layer.startsWith("view/"); // the simulation's own texts have the same size at every distance
  const made = new Words(text, { color: cssColor, size: isLabel ? LABEL : scale[2], fixed: isLabel, isLabel, plate: isLabel ? undefined : "" });
  return made;
}

function triangles({ color, scale, points, colors, lit }) {
  const mesh = colors ? vertexColored(points, colors) : setShadows(new THREE.Mesh(trianglesOf(points), material(color, lit)), color[3]);
  mesh.scale.fromArray(scale.map((one) => one || 1));
  return new THREE.Group().add(mesh);
}

function vertexColored(points, colors) {
  const geometry = positionsOf(points);
  geometry.setAttribute("color", new THREE.BufferAttribute(colors, 4));
  const isTransparent = colors.some((one, number) => number % 4 === 3 && one < 1);
  const options = { vertexColors: true, transparent: isTransparent, depthWrite: !isTransparent, side: THREE.DoubleSide };
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(options));
}

// Return the geometry of triangles, cached if small: the simulation's boxes are triangles of one shape with different scales.
function trianglesOf(points) {
  const key = points.length <= MAX_SHARED_SIZE ? points.join() : "";
  const geometry = sharedGeometries.get(key) ?? positionsOf(points);
  if (!geometry.attributes.normal) geometry.computeVertexNormals();
  if (key && sharedGeometries.size < MAX_SHARED) sharedGeometries.set(key, geometry);
  geometry.userData.shared = sharedGeometries.get(key) === geometry;
  return geometry;
}

function positionsOf(points) {
  const count = 9 * Math.floor(points.length / 9);
  return new THREE.BufferGeometry().setAttribute("position", new THREE.BufferAttribute(points.subarray(0, count), 3));
}

function mesh(marker, changed) {
  const { mesh: address, own, color, scale } = marker;
  const group = new THREE.Group();
  group.scale.fromArray(scale.map((one) => one || 1));
  const outer = new THREE.Group().add(group);
  load(address).then(
    (loaded) => {
      if (outer.userData.gone) return;
      const copy = loaded.clone();
      copy.traverse((one) => {
        if (!one.isMesh) return;
        if (!own) one.material = material(color);
        if (isFloor(marker)) (one.material = one.material.clone()).color.multiply(SUNLIT);
        setShadows(one, one.material.opacity);
      });
      group.add(copy);
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
  cubes: instanced("cube"), spheres: instanced("coarse"), points: dots, text: words, triangles, mesh,
};
