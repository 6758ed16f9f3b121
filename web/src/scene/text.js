// Text in the scene, on a plate that faces the camera. Its size is in m, or constant on the screen.
import * as THREE from "three";

const FONT = 36; // px, font size in the texture
const LINE = 1.25; // line height in font sizes
const PAD = 10; // px in the texture
const at = new THREE.Vector3();

export class Words extends THREE.Sprite {
  static unit = 0.001; // m per CSS pixel at a distance of 1 m
  /** @type {THREE.Vector3 | null} */
  static above = null; // tip of the handles in the world; vehicle labels that would cover them are raised above it
  // `size`: font size in m or, with `fixed`, in CSS pixels at every distance.
  constructor(text, { color = "#1a1f29", plate = "rgba(255,255,255,0.78)", size = 0.05, fixed = false, isLabel = false } = {}) {
    super(new THREE.SpriteMaterial({ sizeAttenuation: !fixed, transparent: true, depthWrite: false, depthTest: !fixed }));
    this.color = color;
    this.plate = plate;
    this.size = size;
    this.fixed = fixed;
    this.isLabel = isLabel;
    this.pixels = [0, 0]; // width and height of the texture
    this.center.set(0.5, 0);
    this.renderOrder = 5;
    this.raycast = () => {};
    this.say(text);
  }

  // Raise a plate that would cover the handles, and lower one that the upper edge of the picture would cut.
  onBeforeRender(_renderer, _scene, camera) {
    if (!this.fixed) return;
    const { y } = at.setFromMatrixPosition(this.matrixWorld).project(camera);
    const height = this.scale.y * camera.projectionMatrix.elements[5]; // in half heights of the picture
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
    // The width is a multiple of the font size, so that changing numbers do not make the plate jump.
    const width = Math.ceil(Math.max(...lines.map((line) => pen.measureText(line).width)) / FONT) * FONT;
    canvas.width = Math.max(2, width + 2 * PAD);
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
