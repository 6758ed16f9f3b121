// Texts that the cockpit has not saved yet: { text, version, name? } by script. The browser stores them, so that neither
// the end of the cockpit nor a reload loses them. Drafts that another tab stores later are not visible to this page.
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

  // Return whether the page may be closed: there is no draft of the script, or the browser has stored it.
  isSafe(script) {
    return !this.drafts.has(script) || isStored(PREFIX + script, this.drafts.get(script));
  }
}
