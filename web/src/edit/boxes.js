// The box about meshes, along the axes of the world.
import * as THREE from "three";

// `places` count where there is no mesh: matrices of the world.
export function boxOf(meshes, places) {
  const box = new THREE.Box3();
  for (const mesh of meshes) box.expandByObject(mesh, true);
  if (box.isEmpty()) for (const one of places) box.expandByPoint(new THREE.Vector3().setFromMatrixPosition(one));
  return box;
}
