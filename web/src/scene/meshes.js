// Mesh files from the node, each loaded once.
import * as THREE from "three";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";
import { quality } from "./looks.js";

const loader = new GLTFLoader();
const scenes = new Map(); // promises of three.js scenes, by address

export function load(address) {
  if (!scenes.has(address)) {
    const loading = loader.loadAsync(address).then(({ scene }) => prepare(scene));
    loading.catch(() => scenes.delete(address));
    scenes.set(address, loading);
  }
  return scenes.get(address);
}

function prepare(scene) {
  scene.traverse((one) => {
    if (!one.isMesh) return;
    one.geometry.userData.shared = true;
    if (!one.geometry.attributes.normal) one.geometry.computeVertexNormals();
    one.material = lambertOf(one.material);
  });
  return scene;
}

// Return a material for the page's lights with the look of a glTF material.
function lambertOf(material) {
  const map = material.map ?? null;
  if (map) {
    map.colorSpace = THREE.NoColorSpace;
    map.anisotropy = quality.anisotropy;
    map.userData.shared = true;
  }
  const { color, opacity, transparent, alphaTest, vertexColors } = material;
  const result = new THREE.MeshLambertMaterial({ map, color, opacity, transparent, alphaTest, vertexColors, side: THREE.DoubleSide });
  result.depthWrite = !transparent;
  result.userData.shared = true;
  return result;
}
