// The canvas of the scene: painted when something has changed, and at no other time.
import * as THREE from "three";

const SLOW = /swiftshader|llvmpipe|softpipe|software|basic render/i;

// Whether pictures are made without a GPU: then there are no shadows, and no smooth edges.
function paintsInSoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const slow = gl !== null && SLOW.test(names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : gl.getParameter(gl.RENDERER));
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return slow;
}

export class Canvas {
  // `paint(renderer, seconds)` makes a picture, after so many s since the last one.
  constructor(element, paint) {
    this.element = element;
    this.paint = paint;
    this.isFast = !paintsInSoftware();
    this.renderer = this.begin();
    this.dom = this.renderer?.domElement ?? document.createElement("canvas");
    this.dom.style.cssText = "display:block;width:100%;height:100%;touch-action:none;outline-offset:-3px";
    element.append(this.dom);
    this.onFit = (_width, _height) => {};
    this.after = []; // what is done once the next picture is there
    this.frames = 0;
    new ResizeObserver(() => this.fit()).observe(element);
    this.dom.addEventListener("webglcontextlost", (event) => event.preventDefault());
    this.dom.addEventListener("webglcontextrestored", () => this.change());
  }

  // Returns what paints, null where the browser has nothing for that: all else in the page goes on.
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
    this.draw(); // at once, or it would be empty for a moment
  }

  // Asks for another picture.
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
