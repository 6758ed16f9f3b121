// Call `move(event)` for a pressed pointer anywhere in the window, then `end(event, isCancelled)` at its release.
export function follow({ pointerId }, move, end) {
  const ofPointer = (handler) => (event) => event.pointerId === pointerId && handler(event);
  const controller = new AbortController();
  const on = (name, handler) => window.addEventListener(name, ofPointer(handler), { signal: controller.signal });
  on("pointermove", move);
  for (const name of ["pointerup", "pointercancel"]) {
    on(name, (event) => {
      controller.abort();
      end(event, name === "pointercancel");
    });
  }
}
