// Sky, ground and sun, as the simulated cameras see them.
import * as THREE from "three";

const TO_SUN = new THREE.Vector3(-0.34, 0.3, 0.89).normalize();
const BELOW = 0x6b6966, ABOVE = 0x858a91, SUN = 0x8a857a; // what a surface gets of each, as in scene_markers.py
// Elevation in degrees, and the colour there: sky.py
const BANDS = [
  [-90, [0.6, 0.62, 0.61]], [-8, [0.69, 0.71, 0.72]], [-0.5, [0.78, 0.81, 0.835]], [1.5, [0.84, 0.88, 0.92]], [6, [0.74, 0.83, 0.92]],
  [20, [0.56, 0.71, 0.88]], [45, [0.4, 0.59, 0.83]], [90, [0.3, 0.5, 0.78]],
];
const AROUND = 16; // sides of the sky
const FAR = 1500; // m, how far the ground goes
const SHADOWED = 6; // m, each way from the drone
const TEXELS = 2048;

export class Surroundings {
  constructor(scene, isFast) {
    this.sky = sky();
    this.ground = ground();
    this.sun = new THREE.DirectionalLight(SUN, Math.PI);
    this.sun.shadow.mapSize.set(TEXELS, TEXELS);
    this.sun.shadow.normalBias = 0.02;
    this.sun.shadow.bias = -0.0005;
    Object.assign(this.sun.shadow.camera, { left: -SHADOWED, right: SHADOWED, top: SHADOWED, bottom: -SHADOWED, near: 1, far: 80 });
    this.sun.castShadow = isFast;
    scene.add(this.sky, this.ground, this.sun, this.sun.target, new THREE.HemisphereLight(ABOVE, BELOW, Math.PI));
    this.shine(new THREE.Vector3());
  }

  // Lets sky and ground be about who looks, and the shadows about a place.
  follow(camera, place) {
    this.sky.position.copy(camera.position);
    this.ground.position.set(camera.position.x, camera.position.y, 0);
    this.shine(place);
  }

  // The sun moves by whole texels of its shadows, whose edges would flicker otherwise.
  shine(place) {
    const texel = (2 * SHADOWED) / TEXELS;
    const turn = new THREE.Quaternion().setFromUnitVectors(TO_SUN, new THREE.Vector3(0, 0, 1));
    const seen = place.clone().applyQuaternion(turn);
    seen.set(Math.round(seen.x / texel) * texel, Math.round(seen.y / texel) * texel, Math.round(seen.z / texel) * texel);
    this.sun.target.position.copy(seen.applyQuaternion(turn.invert()));
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
  const mesh = behind(new THREE.Mesh(geometry, paint), 1);
  mesh.scale.setScalar(2 * FAR);
  return mesh;
}

// A disc about who looks, with lines of the world every metre and every five; far away it is lost in the haze. Like the
// sky it is painted where nothing else is, and it is a little farther away than it seems: so it cannot fight with the floor.
function ground() {
  const paint = new THREE.ShaderMaterial({
    blending: THREE.CustomBlending, // and not `transparent`, which would be painted last
    blendSrcAlpha: THREE.ZeroFactor, // the canvas itself stays opaque
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
        vec3 color = mix(vec3(0.50, 0.52, 0.51), vec3(0.74, 0.765, 0.78), 1.0 - exp(-far / 30.0)) * (1.0 - dark);
        gl_FragColor = vec4(color, exp(-far * far / 160000.0));
      }`,
  });
  return behind(new THREE.Mesh(new THREE.CircleGeometry(FAR, 64), paint), 2);
}

function behind(mesh, order) {
  mesh.renderOrder = order;
  mesh.frustumCulled = false;
  mesh.raycast = () => {};
  return mesh;
}
