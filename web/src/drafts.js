// Texts that the node has not saved yet: { text, version } by script. The browser stores them, so that neither a node
// that ends nor a reload loses them. Drafts that another tab writes later are not this page's.
import { forget, isStored, keep, kept, keysBelow } from "./storage.js";

const PREFIX = "draft/";

export class Drafts {
  constructor() {
    this.drafts = new Map();
    for (const script of keysBelow(PREFIX)) {
      const draft = kept(PREFIX + script);
      if (draft) this.drafts.set(script, draft);
    }
  }

  get(script) {
    return this.drafts.get(script);
  }

  get scripts() {
    return [...this.drafts.keys()];
  }

  put(script, draft) {
    this.drafts.set(script, draft);
    keep(PREFIX + script, draft);
  }

  drop(script) {
    this.drafts.delete(script);
    forget(PREFIX + script);
  }

  // Whether the page may be closed: there is no draft, or the browser has stored it.
  isSafe(script) {
    return !this.drafts.has(script) || isStored(PREFIX + script, this.drafts.get(script));
  }
}
