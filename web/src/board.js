// The latest panel contents from the cockpit, by part. A listener is called at once, and whenever its part changes.
export class Board {
  constructor() {
    this.parts = new Map();
    this.versions = new Map();
    this.hearing = new Map();
  }

  // Store the parts of a message and call their listeners. A part is skipped if a newer version of it has arrived before.
  take({ panel, version }) {
    for (const [part, content] of Object.entries(panel)) {
      if (version < (this.versions.get(part) ?? -1)) continue;
      this.versions.set(part, version);
      this.parts.set(part, content);
      for (const show of this.hearing.get(part) ?? []) show(content);
    }
  }

  // Forget all version numbers, because a restarted cockpit counts from the beginning.
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
