// Sky, ground, sun and metre marks of the page. They are brighter than in the simulated cameras, which do not see them.
import * as THREE from "three";
import { quality } from "./looks.js";

const TO_SUN = new THREE.Vector3(-0.34, 0.3, 0.89).normalize();
const BELOW = 0x6b6966, ABOVE = 0x858a91, SUN = 0x8a857a; // light on a surface from each, as in scene_markers.py
// Colors of the sky by elevation (degrees).
/** @type {[elevation: number, color: number[]][]} */
const BANDS = [
  [-90, [0.72, 0.78, 0.68]], [-4, [0.8, 0.86, 0.82]], [-0.5, [0.9, 0.94, 0.95]], [1.5, [0.89, 0.945, 0.985]], [6, [0.7, 0.845, 0.975]],
  [20, [0.52, 0.73, 0.95]], [45, [0.42, 0.65, 0.92]], [90, [0.3, 0.54, 0.86]],
];
const MEADOW = "0.66, 0.74, 0.6", HAZE = "0.88, 0.92, 0.92"; // ground colors: near, and far away
const MARKED = 5; // m, to which the axes are marked
const MARK = 0.3; // m, width of an axis's strip
const LINE = 0.012; // m, width of an axis's line
const DENSE = 200; // px of a strip's texture per metre
const AROUND = 16; // sides of the sky's sphere
const FAR = 1500; // m, radius of the ground
const SHADOWED = 6; // m around the drone that have shadows
const TEXELS = 2048; // width and height of the shadow map

export class Surroundings {
  constructor(scene, isFast) {
    this.sky = sky();
    this.ground = ground();
    this.marks = marks();
    this.sun = new THREE.DirectionalLight(SUN, Math.PI);
    this.sun.shadow.mapSize.set(TEXELS, TEXELS);
    this.sun.shadow.normalBias = 0.02;
    this.sun.shadow.bias = -0.0005;
    Object.assign(this.sun.shadow.camera, { left: -SHADOWED, right: SHADOWED, top: SHADOWED, bottom: -SHADOWED, near: 1, far: 80 });
    this.sun.castShadow = isFast;
    scene.add(this.sky, this.ground, this.marks, this.sun, this.sun.target, new THREE.HemisphereLight(ABOVE, BELOW, Math.PI));
    this.shine(new THREE.Vector3());
  }

  // Center sky and ground on the camera, and the shadows on `place`.
  follow(camera, place) {
    this.sky.position.copy(camera.position);
    this.ground.position.set(camera.position.x, camera.position.y, 0);
    this.shine(place);
  }

  // Center the shadows on `place`. The sun moves by whole texels of the shadow map: shadow edges would flicker otherwise.
  shine(place) {
    const texel = (2 * SHADOWED) / TEXELS;
    const rotation = new THREE.Quaternion().setFromUnitVectors(TO_SUN, new THREE.Vector3(0, 0, 1));
    const snapped = place.clone().applyQuaternion(rotation);
    snapped.set(Math.round(snapped.x / texel) * texel, Math.round(snapped.y / texel) * texel, Math.round(snapped.z / texel) * texel);
    this.sun.target.position.copy(snapped.applyQuaternion(rotation.invert()));
    this.sun.position.copy(this.sun.target.position).addScaledVector(TO_SUN, 40);
    this.sun.target.updateMatrixWorld();
  }
}

function sky() {
  const points = [], colors = [], faces = [];
  for (const [elevation, color] of BANDS) {
    const up = THREE.MathUtils.degToRad(elevation);
    for (let side = 0; side <= AROUND; side++) {
      const around = (2 * Math.PI * side) / AROUND;
      points.push(Math.cos(up) * Math.cos(around), Math.cos(up) * Math.sin(around), Math.sin(up));
      colors.push(...color);
    }
  }
  const row = AROUND + 1;
  for (let band = 0; band < BANDS.length - 1; band++) {
    for (let side = 0; side < AROUND; side++) {
      const at = band * row + side;
      faces.push(at, at + 1, at + row, at + 1, at + row + 1, at + row);
    }
  }
  const geometry = new THREE.BufferGeometry().setIndex(faces);
  geometry.setAttribute("position", new THREE.Float32BufferAttribute(points, 3));
  geometry.setAttribute("color", new THREE.Float32BufferAttribute(colors, 3));
  const paint = new THREE.MeshBasicMaterial({ vertexColors: true, side: THREE.DoubleSide, depthWrite: false });
  const mesh = background(new THREE.Mesh(geometry, paint), 1);
  mesh.scale.setScalar(2 * FAR);
  return mesh;
}

// Return a disc around the camera with grid lines every metre and every five, which fades into the haze. Like the sky it is
// drawn after the opaque objects, where they left space; its depth offset avoids flicker against the floor.
function ground() {
  const paint = new THREE.ShaderMaterial({
    blending: THREE.CustomBlending, // not `transparent`, which would be drawn over transparent objects
    blendSrcAlpha: THREE.ZeroFactor, // the canvas stays opaque
    blendDstAlpha: THREE.OneFactor,
    depthWrite: false,
    polygonOffset: true,
    polygonOffsetFactor: 2,
    polygonOffsetUnits: 16,
    vertexShader: `
      varying vec2 at;
      varying vec2 away;
      void main() {
        vec4 place = modelMatrix * vec4(position, 1.0);
        at = place.xy;
        away = position.xy;
        gl_Position = projectionMatrix * viewMatrix * place;
      }`,
    fragmentShader: `
      varying vec2 at;
      varying vec2 away;
      float lines(vec2 place, float width) {
        vec2 wide = fwidth(place);
        vec2 near = abs(fract(place - 0.5) - 0.5);
        vec2 line = (1.0 - smoothstep(vec2(width), wide * 1.5 + width, near)) * clamp(width / wide, 0.0, 1.0);
        return max(line.x, line.y);
      }
      void main() {
        float far = length(away);
        float dark = 0.10 * lines(at, 0.012) + 0.14 * lines(at / 5.0, 0.006);
        vec3 color = mix(vec3(${MEADOW}), vec3(${HAZE}), 1.0 - exp(-far / 90.0)) * (1.0 - dark);
        gl_FragColor = vec4(color, exp(-far * far / 160000.0));
      }`,
  });
  return background(new THREE.Mesh(new THREE.CircleGeometry(FAR, 64), paint), 2);
}

// Return strips along the x and y axes on the floor with labels in metres, upright for a camera that looks along x.
function marks() {
  const metres = [1, 2, 3, 4];
  const x = strip(MARK, MARKED, "#c92a2a", [0, 0, LINE, MARKED], (mark) => metres.forEach((metre) => mark(`${metre} m`, 0.17, MARKED - metre)));
  const y = strip(2 * MARKED, MARK, "#2b8a3e", [0, 0, 2 * MARKED, LINE], (mark) => metres.forEach((metre) => [-1, 1].forEach((side) => mark(`${side * metre}`, MARKED - side * metre, 0.18))));
  x.position.set(MARKED / 2, -MARK / 2, 0.002);
  y.position.set(-MARK / 2, 0, 0.002);
  return new THREE.Group().add(x, y);
}

// Return a plate on the floor, its top towards x. Sizes and `line` [left, top, width, height] are in m; `write` adds words.
function strip(width, height, color, line, write) {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width: width * DENSE, height: height * DENSE });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  Object.assign(pen, { font: `500 ${0.13 * DENSE}px system-ui, "DejaVu Sans", sans-serif`, textAlign: "center", textBaseline: "middle" });
  pen.fillStyle = color;
  const [left, top, lineWidth, lineHeight] = line.map((metres) => metres * DENSE);
  pen.fillRect(left, top, lineWidth, lineHeight);
  pen.fillStyle = "#1a1f29";
  write((words, right, down) => pen.fillText(words, right * DENSE, down * DENSE));
  const map = new THREE.CanvasTexture(canvas);
  map.anisotropy = quality.anisotropy;
  const paint = new THREE.MeshBasicMaterial({ map, opacity: 0.8, transparent: true, depthWrite: false, polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1 });
  const plate = new THREE.Mesh(new THREE.PlaneGeometry(width, height), paint);
  plate.rotation.z = -Math.PI / 2;
  plate.raycast = () => {};
  return plate;
}

function background(mesh, order) {
  mesh.renderOrder = order;
  mesh.frustumCulled = false;
  mesh.raycast = () => {};
  return mesh;
}
