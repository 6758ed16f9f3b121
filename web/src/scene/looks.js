// Materials and shapes that many markers share. Colours are those of the screen, as in the simulated cameras: three's
// own management of colours is off, and light adds up as it does there.
import * as THREE from "three";

THREE.ColorManagement.enabled = false;
THREE.Object3D.DEFAULT_UP.set(0, 0, 1);
THREE.Object3D.DEFAULT_MATRIX_AUTO_UPDATE = true;

// The cameras' sun wraps a little around what it lights: 0.85 n·s + 0.15.
THREE.ShaderChunk.lights_lambert_pars_fragment = THREE.ShaderChunk.lights_lambert_pars_fragment.replace(
  "saturate( dot( geometryNormal, directLight.direction ) )",
  "saturate( 0.85 * dot( geometryNormal, directLight.direction ) + 0.15 )",
);

// How much is spent on a picture: textures that are seen from aside cost four fifths of one that is made without a GPU.
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

// The floor is brighter than in the cameras.
export const SUNLIT = new THREE.Color(1.19, 1.17, 1.13);
export const isFloor = ({ layer, ns }) => layer === "view/surroundings" && ns === "floor";

const known = new Map();

/**
 * A material for a colour r g b a, 0..1, which all that has this colour shares.
 * @param {number[]} color
 */
export function material([r, g, b, a], lit = true) {
  const key = `${r} ${g} ${b} ${a} ${lit}`;
  let found = known.get(key);
  if (!found) {
    const look = { color: new THREE.Color(r, g, b), opacity: a, transparent: a < 1, depthWrite: a >= 1, side: THREE.DoubleSide };
    found = lit ? new THREE.MeshLambertMaterial(look) : new THREE.MeshBasicMaterial(look);
    found.userData.shared = true;
    known.set(key, found);
  }
  return found;
}

/** @type {(one: THREE.Object3D) => one is THREE.Mesh} */
export const isSingleMesh = (one) => one instanceof THREE.Mesh && !(one instanceof THREE.InstancedMesh);

// Frees what a part of the scene alone has used.
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

// The axes of a frame: x red, y green, z blue.
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
