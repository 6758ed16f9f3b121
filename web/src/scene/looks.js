// Materials and shapes that markers share. Colors are display values, as in the simulated cameras: three.js's color
// management is off, and light is added up in display values, as there.
import * as THREE from "three";

THREE.ColorManagement.enabled = false;
THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
THREE.Object3D.DEFAULT_MATRIX_AUTO_UPDATE = true;

// Wrapped diffuse light, as in the shaders of the simulated cameras: 0.85 n·s + 0.15.
THREE.ShaderChunk.lights_lambert_pars_fragment = THREE.ShaderChunk.lights_lambert_pars_fragment.replace(
  "saturate( dot( geometryNormal, directLight.direction ) )",
  "saturate( 0.85 * dot( geometryNormal, directLight.direction ) + 0.15 )",
);

// Rendering quality. Without a GPU, anisotropic filtering takes four fifths of a frame's time; scene.js raises it with one.
export const quality = { anisotropy: 1 };

export const INK = 0x1a1f29;
export const ACCENT = 0xe8590c;
const AXES = [0xd62828, 0x2b9a3e, 0x2f6fde];

export const SHAPES = {
  cube: new THREE.BoxGeometry(1, 1, 1),
  sphere: new THREE.SphereGeometry(0.5, 24, 16),
  cylinder: new THREE.CylinderGeometry(0.5, 0.5, 1, 32).rotateX(Math.PI / 2), // along z, as in rviz
  cone: new THREE.ConeGeometry(0.5, 1, 24).rotateX(Math.PI / 2),
  coarse: new THREE.SphereGeometry(0.5, 10, 8),
};
for (const shape of Object.values(SHAPES)) shape.userData.shared = true;

// Factors (r, g, b) that make the floor brighter than in the simulated cameras.
export const SUNLIT = new THREE.Color(1.19, 1.17, 1.13);
export const isFloor = ({ layer, ns }) => layer === "view/surroundings" && ns === "floor";

const materials = new Map();

/**
 * Return the material of a color r g b a (0..1), shared by all objects of this color; `lit`: shaded by the lights.
 * @param {number[]} color
 */
export function material([r, g, b, a], lit = true) {
  const key = `${r} ${g} ${b} ${a} ${lit}`;
  let shared = materials.get(key);
  if (!shared) {
    const options = { color: new THREE.Color(r, g, b), opacity: a, transparent: a < 1, depthWrite: a >= 1, side: THREE.DoubleSide };
    shared = lit ? new THREE.MeshLambertMaterial(options) : new THREE.MeshBasicMaterial(options);
    shared.userData.shared = true;
    materials.set(key, shared);
  }
  return shared;
}

/** @type {(one: THREE.Object3D) => one is THREE.Mesh} */
export const isSingleMesh = (one) => one instanceof THREE.Mesh && !(one instanceof THREE.InstancedMesh);

// Free the GPU resources that only `object` and its descendants use.
export function dispose(object) {
  object.traverse((one) => {
    if (one.geometry && !one.geometry.userData.shared) one.geometry.dispose();
    for (const material of [one.material].flat()) {
      if (!material || material.userData.shared) continue;
      if (material.map && !material.map.userData.shared) material.map.dispose();
      material.dispose();
    }
  });
}

// Return the axes of a frame (length and radius in m): x red, y green, z blue.
export function axes(length = 0.1, radius = 0.0015) {
  const group = new THREE.Group();
  AXES.forEach((color, axis) => {
    const bar = new THREE.Mesh(SHAPES.cube, material([...new THREE.Color(color).toArray(), 1], false));
    bar.scale.setScalar(2 * radius).setComponent(axis, length);
    bar.position.setComponent(axis, length / 2);
    group.add(bar);
  });
  return group;
}
