// What a browser remembers of the page; one that keeps nothing remembers it until the page is closed.
const PREFIX = "drone_sim/";
const here = new Map();

export function kept(key, otherwise) {
  try {
    const found = localStorage[PREFIX + key];
    if (found !== undefined) return JSON.parse(found);
  } catch {
    // None, or not ours.
  }
  return here.has(key) ? here.get(key) : otherwise;
}

export function keep(key, value) {
  here.set(key, value);
  try {
    localStorage[PREFIX + key] = JSON.stringify(value);
  } catch {
    // Full, or none.
  }
}
