// Follows a pointer that has been pressed, wherever it goes, until it is let go.
export function follow({ pointerId }, move, end) {
  const isOurs = (act) => (event) => event.pointerId === pointerId && act(event);
  const stop = new AbortController();
  const on = (name, act) => window.addEventListener(name, isOurs(act), { signal: stop.signal });
  on("pointermove", move);
  for (const name of ["pointerup", "pointercancel"]) {
    on(name, (event) => {
      stop.abort();
      end(event, name === "pointercancel");
    });
  }
}
