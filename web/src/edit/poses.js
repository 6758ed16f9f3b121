// Conversions of poses. The node sends x, y, z (m) and a quaternion x, y, z, w; the page shows V-REP's angles in degrees.
import * as THREE from "three";

const DEGREE = Math.PI / 180;
const ORDER = "XYZ"; // V-REP's alpha, beta, gamma: about the object's own x, then y, then z
const ONE = new THREE.Vector3(1, 1, 1);

/** @param {number[]} pose */
export function matrixOf([x, y, z, qx, qy, qz, qw]) {
  return new THREE.Matrix4().compose(new THREE.Vector3(x, y, z), new THREE.Quaternion(qx, qy, qz, qw).normalize(), ONE);
}

/**
 * @param {THREE.Matrix4} matrix
 * @returns {[...position: [number, number, number], ...quaternion: [number, number, number, number]]}
 */
export function poseOf(matrix) {
  const [position, quaternion] = [new THREE.Vector3(), new THREE.Quaternion()];
  matrix.decompose(position, quaternion, new THREE.Vector3());
  return [...position.toArray(), ...quaternion.toArray()];
}

// Return the position in m and V-REP's angles in degrees of a matrix.
export function numbersOf(matrix) {
  const [x, y, z, ...quaternion] = poseOf(matrix);
  const angles = new THREE.Euler().setFromQuaternion(new THREE.Quaternion(...quaternion), ORDER);
  return [x, y, z, ...[angles.x, angles.y, angles.z].map((one) => one / DEGREE)];
}

/** @param {number[]} numbers */
export function matrixOfNumbers([x, y, z, ...angles]) {
  const [alpha, beta, gamma] = angles.map((one) => one * DEGREE);
  const quaternion = new THREE.Quaternion().setFromEuler(new THREE.Euler(alpha, beta, gamma, ORDER));
  return new THREE.Matrix4().compose(new THREE.Vector3(x, y, z), quaternion, ONE);
}

// Return the pose of `matrix` relative to `frame`, both matrices in the world.
export const seenFrom = (frame, matrix) => frame.clone().invert().multiply(matrix);
