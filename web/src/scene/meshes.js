// Mesh files from the node, each loaded once.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { quality } from "./looks.js";

const loader = new GLTFLoader();
const known = new Map(); // promises of scenes, by address

export function load(address) {
  if (!known.has(address)) {
    const loading = loader.loadAsync(address).then(({ scene }) => prepare(scene));
    loading.catch(() => known.delete(address));
    known.set(address, loading);
  }
  return known.get(address);
}

function prepare(scene) {
  scene.traverse((one) => {
    if (!one.isMesh) return;
    one.geometry.userData.shared = true;
    if (!one.geometry.attributes.normal) one.geometry.computeVertexNormals();
    one.material = plain(one.material);
  });
  return scene;
}

// What a material of glTF looks like in our light.
function plain(from) {
  const map = from.map ?? null;
  if (map) {
    map.colorSpace = THREE.NoColorSpace;
    map.anisotropy = quality.anisotropy;
    map.userData.shared = true;
  }
  const { color, opacity, transparent, alphaTest, vertexColors } = from;
  const made = new THREE.MeshLambertMaterial({ map, color, opacity, transparent, alphaTest, vertexColors, side: THREE.DoubleSide });
  made.depthWrite = !transparent;
  made.userData.shared = true;
  return made;
}
