// A bar between two parts of the page, moved by pointer or arrow keys. The browser stores its position.
import { keep, kept } from "./storage.js";

const STEP = 24; // px for each press of an arrow key

// Make `bar` set the CSS variable `property` (px, from `low` to `high()`) on the page's root. `measure(event)` returns the
// value for the pointer's position; `along` is "x" or "y".
export function split(bar, property, along, low, high, measure) {
  const root = document.documentElement;
  const key = `size/${property}`;
  const set = (value) => {
    const size = Math.round(Math.min(Math.max(value, low), high()));
    root.style.setProperty(property, `${size}px`);
    bar.setAttribute("aria-valuenow", String(size));
    return size;
  };
  const move = (value) => keep(key, set(value));
  const currentSize = () => {
    const box = bar.getBoundingClientRect();
    return measure({ clientX: box.x + box.width / 2, clientY: box.y + box.height / 2 });
  };
  bar.setAttribute("aria-valuenow", String(low));
  if (Number(kept(key, 0))) set(Number(kept(key, 0)));
  bar.addEventListener("focus", () => bar.setAttribute("aria-valuenow", String(Math.round(currentSize()))));
  bar.addEventListener("pointerdown", (event) => bar.setPointerCapture(event.pointerId));
  bar.addEventListener("pointermove", (event) => bar.hasPointerCapture(event.pointerId) && move(measure(event)));
  const [less, more] = along === "x" ? ["ArrowRight", "ArrowLeft"] : ["ArrowUp", "ArrowDown"];
  bar.addEventListener("keydown", (event) => {
    const direction = event.key === more ? 1 : event.key === less ? -1 : 0;
    if (!direction) return;
    event.preventDefault();
    event.stopPropagation();
    move(currentSize() + direction * STEP);
  });
}
