// Words in the scene: on a plate, turned to who looks; of a size in m, or of one on the screen.
import * as THREE from "three";

const FONT = 36; // px, in which it is painted
const LINE = 1.25;
const PAD = 10;
const at = new THREE.Vector3();

export class Words extends THREE.Sprite {
  static unit = 0.001; // m, how large a CSS pixel is at 1 m
  /** @type {THREE.Vector3 | null} */
  static above = null; // the tip of the handles, in the world: the labels of vehicles stand above it
  // `size`: m of a line, or with `fixed` CSS pixels, near and far.
  constructor(text, { color = "#1a1f29", plate = "rgba(255,255,255,0.78)", size = 0.05, fixed = false, isLabel = false } = {}) {
    super(new THREE.SpriteMaterial({ sizeAttenuation: !fixed, transparent: true, depthWrite: false, depthTest: !fixed }));
    this.color = color;
    this.plate = plate;
    this.size = size;
    this.fixed = fixed;
    this.isLabel = isLabel;
    this.pixels = [0, 0]; // width and height of what is painted
    this.center.set(0.5, 0);
    this.renderOrder = 5;
    this.raycast = () => {};
    this.say(text);
  }

  // A plate that would cover handles is raised; one that would reach over the picture's upper edge is lowered.
  onBeforeRender(_renderer, _scene, camera) {
    if (!this.fixed) return;
    const { y } = at.setFromMatrixPosition(this.matrixWorld).project(camera);
    const height = this.scale.y * camera.projectionMatrix.elements[5]; // half pictures
    const raised = this.isLabel && Words.above ? (y - at.copy(Words.above).project(camera).y) / height : 0;
    this.center.y = Math.min(1, Math.max(Math.min(0, raised), 1 - (1 - y) / height));
  }

  say(text) {
    if (text === this.text) return;
    this.text = text;
    const lines = text.split("\n");
    const canvas = document.createElement("canvas");
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    const font = `500 ${FONT}px system-ui, "DejaVu Sans", sans-serif`;
    pen.font = font;
    // Numbers that change do not let the plate jump: its width grows in steps.
    const wide = Math.ceil(Math.max(...lines.map((line) => pen.measureText(line).width)) / FONT) * FONT;
    canvas.width = Math.max(2, wide + 2 * PAD);
    canvas.height = Math.ceil(lines.length * LINE * FONT) + 2 * PAD;
    pen.font = font;
    if (this.plate) {
      pen.fillStyle = this.plate;
      pen.beginPath();
      pen.roundRect(0, 0, canvas.width, canvas.height, 14);
      pen.fill();
    }
    pen.fillStyle = this.color;
    pen.textBaseline = "middle";
    pen.textAlign = "center";
    lines.forEach((line, number) => pen.fillText(line, canvas.width / 2, PAD + (number + 0.5) * LINE * FONT));
    this.material.map?.dispose();
    this.material.map = new THREE.CanvasTexture(canvas);
    this.material.map.generateMipmaps = true;
    this.material.needsUpdate = true;
    this.pixels = [canvas.width, canvas.height];
    this.fit();
  }

  fit() {
    const scale = (this.fixed ? this.size * Words.unit : this.size) / FONT;
    this.scale.set(this.pixels[0] * scale, this.pixels[1] * scale, 1);
  }
}
