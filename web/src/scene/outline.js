// Outlines of the selected and hovered objects. Their shapes mask the stencil buffer; around the mask, copies are drawn
// that are shifted by some pixels in each of WAYS directions.
import * as THREE from "three";

const WAYS = 8; // directions

export class Outline {
  constructor() {
    this.scene = new THREE.Scene();
    this.size = { value: new THREE.Vector2(1, 1) };
    this.shown = [];
  }

  // Replace the outlines by those of `lit`; `pixels` is the width of the line.
  /** @param {[meshes: THREE.Mesh[], color: number, pixels: number][]} lit */
  show(lit) {
    this.scene.clear();
    lit.forEach(([meshes, color, pixels], number) => this.add(meshes, color, pixels, number + 1));
  }

  add(meshes, color, pixels, reference) {
    const mask = this.paint(reference, color, [0, 0], true);
    const rims = [...Array(WAYS).keys()].map((way) => {
      const angle = (2 * Math.PI * way) / WAYS;
      return this.paint(reference, color, [pixels * Math.cos(angle), pixels * Math.sin(angle)], false);
    });
    for (const mesh of meshes) {
      for (const material of [mask, ...rims]) {
        const copy = new THREE.Mesh(mesh.geometry, material);
        copy.matrixAutoUpdate = copy.matrixWorldAutoUpdate = false;
        copy.matrixWorld = mesh.matrixWorld; // shared: the copy follows its mesh
        copy.renderOrder = material === mask ? 2 * reference : 2 * reference + 1;
        copy.frustumCulled = false;
        this.scene.add(copy);
      }
    }
  }

  paint(reference, color, [right, upwards], isMask) {
    return new THREE.ShaderMaterial({
      uniforms: { color: { value: new THREE.Color(color) }, way: { value: new THREE.Vector2(right, upwards) }, size: this.size },
      vertexShader: `
        uniform vec2 way;
        uniform vec2 size;
        void main() {
          gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
          gl_Position.xy += 2.0 * way / size * gl_Position.w;
        }`,
      fragmentShader: "uniform vec3 color; void main() { gl_FragColor = vec4(color, 1.0); }",
      side: THREE.DoubleSide,
      depthTest: false,
      depthWrite: false,
      colorWrite: !isMask,
      stencilWrite: true, // also enables the stencil test
      stencilRef: reference,
      stencilFunc: isMask ? THREE.AlwaysStencilFunc : THREE.NotEqualStencilFunc,
      stencilZPass: isMask ? THREE.ReplaceStencilOp : THREE.KeepStencilOp,
    });
  }

  render(renderer, camera) {
    if (!this.scene.children.length) return;
    renderer.getSize(this.size.value);
    renderer.render(this.scene, camera);
  }
}
