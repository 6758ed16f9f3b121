// What the node says of the panels, by part; whoever shows a part hears it at once, and when it changes.
export class Board {
  constructor() {
    this.parts = new Map();
    this.versions = new Map();
    this.hearing = new Map();
  }

  // A whole that is older than what has been told since does not overwrite it.
  take({ panel, version }) {
    for (const [part, content] of Object.entries(panel)) {
      if (version < (this.versions.get(part) ?? -1)) continue;
      this.versions.set(part, version);
      this.parts.set(part, content);
      for (const show of this.hearing.get(part) ?? []) show(content);
    }
  }

  // Another node counts anew.
  begin() {
    this.versions.clear();
  }

  /**
   * @template {keyof wire.Panel} Part
   * @param {Part} part
   * @param {wire.Panel[Part]} otherwise
   * @returns {wire.Panel[Part]}
   */
  get(part, otherwise) {
    return this.parts.get(part) ?? otherwise;
  }

  /**
   * @template {keyof wire.Panel} Part
   * @param {Part} part
   * @param {(content: wire.Panel[Part]) => void} show
   */
  on(part, show) {
    this.hearing.set(part, [...(this.hearing.get(part) ?? []), show]);
    if (this.parts.has(part)) show(this.parts.get(part));
  }
}
