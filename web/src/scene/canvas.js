// Canvas of the scene. It is painted only after a change.
import * as THREE from "three";

const SOFTWARE_RENDERERS = /swiftshader|llvmpipe|softpipe|software|basic render/i;

// Return whether WebGL runs without a GPU; shadows and antialiasing are off then.
function isSoftwareRendered() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const extension = gl?.getExtension("WEBGL_debug_renderer_info");
  const isSoftware = gl !== null && SOFTWARE_RENDERERS.test(extension ? gl.getParameter(extension.UNMASKED_RENDERER_WEBGL) : gl.getParameter(gl.RENDERER));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return isSoftware;
}

export class Canvas {
  // `paint(renderer, seconds)` draws a frame; `seconds` is the time since the last one, 0.2 at most.
  constructor(element, paint) {
    this.element = element;
    this.paint = paint;
    this.isFast = !isSoftwareRendered();
    this.renderer = this.begin();
    this.dom = this.renderer?.domElement ?? document.createElement("canvas");
    this.dom.style.cssText = "display:block;width:100%;height:100%;touch-action:none;outline-offset:-3px";
    element.append(this.dom);
    this.onFit = (_width, _height) => {};
    this.after = []; // callbacks for the end of the next frame
    this.frames = 0;
    new ResizeObserver(() => this.fit()).observe(element);
    this.dom.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.dom.addEventListener("webglcontextrestored", () => this.change());
  }

  // Return the WebGL renderer, or null if the browser has no WebGL 2; the rest of the page works without it.
  begin() {
    let renderer;
    try {
      renderer = new THREE.WebGLRenderer({ antialias: this.isFast, stencil: true, powerPreference: "high-performance" });
    } catch {
      this.element.append("This browser cannot draw the scene: it has no WebGL 2, or that is switched off.");
      return null;
    }
    renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
    renderer.shadowMap.enabled = this.isFast;
    renderer.shadowMap.type = THREE.PCFShadowMap;
    renderer.autoClear = false;
    renderer.setPixelRatio(this.isFast ? Math.min(window.devicePixelRatio, 2) : 1);
    return renderer;
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.element;
    if (!width || !height) return;
    this.renderer?.setSize(width, height, false);
    this.onFit(width, height);
    this.draw(); // at once: the new size has cleared the canvas
  }

  // Schedule a repaint at the next animation frame.
  change() {
    this.asked ??= requestAnimationFrame(() => this.draw());
  }

  then(act) {
    this.after.push(act);
    this.change();
  }

  draw() {
    cancelAnimationFrame(this.asked);
    this.asked = undefined;
    const now = performance.now();
    const seconds = Math.min(0.2, (now - (this.drawn ?? now)) / 1000);
    this.drawn = now;
    this.frames++;
    try {
      if (this.renderer) this.paint(this.renderer, seconds);
    } finally {
      for (const act of this.after.splice(0)) act();
    }
  }
}
