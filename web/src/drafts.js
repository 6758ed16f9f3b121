// What is not on the node's disk yet: kept here, and by the browser, so that neither a dead node nor a reload loses it.
const PREFIX = "drone_sim/draft/";

export class Drafts {
  constructor() {
    this.kept = new Map(); // { text, version } by script
    try {
      for (const key of Object.keys(localStorage)) {
        if (key.startsWith(PREFIX)) this.kept.set(key.slice(PREFIX.length), JSON.parse(localStorage[key]));
      }
    } catch {
      // A browser that keeps nothing: until the page is closed, this does.
    }
  }

  get(script) {
    return this.kept.get(script);
  }

  get scripts() {
    return [...this.kept.keys()];
  }

  put(script, draft) {
    this.kept.set(script, draft);
    try {
      localStorage[PREFIX + script] = JSON.stringify(draft);
    } catch {
      // Full, or none: see above.
    }
  }

  drop(script) {
    this.kept.delete(script);
    try {
      localStorage.removeItem(PREFIX + script);
    } catch {
      // There is none.
    }
  }

  // Whether the browser has it, too, so that the page may be closed.
  isSafe(script) {
    try {
      return !this.kept.has(script) || localStorage[PREFIX + script] === JSON.stringify(this.kept.get(script));
    } catch {
      return false;
    }
  }
}
