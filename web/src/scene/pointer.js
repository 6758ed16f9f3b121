// Mouse and touch input on the scene's canvas: a drag orbits, the right button or two fingers pan, the wheel or two
// fingers zoom. A drag that begins on a handle or on the selected object moves the object.
const STILL = 4; // px that the pointer may move during a click
const WHEEL = 0.0012; // exponent of the zoom per px
const LINE = 16; // px per line, for wheels that count lines

export class Pointer {
  // Callbacks in `acts`: take(event) begins a drag and returns "part" (of a handle), "thing" (an object) or null; drag(event),
  // drop(), click(event), look(event) by a double click, hover(event or null), orbit and pan (right, down: px), zoom(factor)
  constructor(element, acts) {
    this.element = element;
    this.acts = acts;
    this.fingers = new Map();
    /** @type {"orbit" | "pan" | "pinch" | "drag" | null} */
    this.does = null;
    const on = (name, act, options) => element.addEventListener(name, act, options);
    on("pointerdown", (event) => this.down(event));
    on("pointermove", (event) => this.move(event));
    on("pointerup", (event) => this.up(event));
    on("pointercancel", (event) => this.up(event, true));
    on("pointerleave", () => this.fingers.size || acts.hover(null));
    on("dblclick", (event) => acts.look(event));
    on("contextmenu", (event) => event.preventDefault());
    on("wheel", (event) => this.wheel(event), { passive: false });
  }

  down(event) {
    this.element.focus({ preventScroll: true });
    this.element.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, event);
    if (this.fingers.size === 2) {
      if (this.does === "drag") this.acts.drop();
      this.does = "pinch";
      this.isClick = false;
      return;
    }
    this.began = event;
    const pans = event.button !== 0 || event.shiftKey;
    const taken = pans ? null : this.acts.take(event);
    this.does = taken ? "drag" : pans ? "pan" : "orbit";
    this.isClick = event.button === 0 && taken !== "part"; // until the pointer moves by more than STILL
  }

  move(event) {
    const before = this.fingers.get(event.pointerId);
    if (!before) return void this.acts.hover(event);
    const [right, down] = [event.clientX - before.clientX, event.clientY - before.clientY];
    if (this.does === "pinch") this.pinch(event, right, down);
    this.fingers.set(event.pointerId, event);
    if (Math.hypot(event.clientX - this.began.clientX, event.clientY - this.began.clientY) > STILL) this.isClick = false;
    if (this.isClick) return;
    if (this.does === "drag") this.acts.drag(event);
    else if (this.does && this.does in this.acts) this.acts[this.does](right, down);
  }

  pinch(event, right, down) {
    const [other] = [...this.fingers.values()].filter((one) => one.pointerId !== event.pointerId);
    const before = this.fingers.get(event.pointerId);
    const apart = (one) => Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
    this.acts.zoom(apart(before) / Math.max(apart(event), 1));
    this.acts.pan(right / 2, down / 2);
  }

  up(event, isCancelled = false) {
    if (!this.fingers.delete(event.pointerId)) return;
    if (this.does === "drag") this.acts.drop();
    if (this.isClick && !isCancelled && !this.fingers.size) this.acts.click(event);
    this.isClick = false;
    this.does = this.fingers.size ? "orbit" : null;
  }

  wheel(event) {
    event.preventDefault();
    const pixels = event.deltaMode ? event.deltaY * LINE : event.deltaY;
    this.acts.zoom(Math.exp(WHEEL * Math.max(-300, Math.min(300, pixels))));
  }
}
