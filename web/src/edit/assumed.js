// Values that the page has requested and the node has not sent yet. The page shows them meanwhile; otherwise a second
// number that the user enters would restore the old value of the first.
export class Assumed {
  /** @param {import("./objects.js").Objects} objects */
  constructor(objects) {
    this.objects = objects;
    this.busy = 0; // number of edits without an answer yet
    this.known = 0; // the revision that the node has sent
    this.told = new Map(); // { one, matrix, values } as sent by the node, of objects with assumed values, by handle
    this.reached = 0; // the revision of the last answer
    /** @type {Map<number, import("three").Matrix4>} */
    this.matrices = new Map(); // assumed poses in the world, by handle
    /** @type {Map<number, Record<string, any>>} */
    this.values = new Map(); // assumed values of keys, by handle
  }

  // Drop the assumed values, and restore those that the node has sent.
  clear() {
    for (const { one, ...told } of this.told.values()) Object.assign(one, told);
    this.reached = 0;
    for (const map of [this.matrices, this.values, this.told]) map.clear();
  }

  put(handle, matrix) {
    const motion = matrix.clone().multiply(this.objects.existing(handle).matrix.clone().invert());
    for (const one of this.objects.withBelow(handle)) this.matrices.set(one, motion.clone().multiply(this.objects.existing(one).matrix));
    this.apply();
  }

  set(handle, values) {
    this.values.set(handle, { ...this.values.get(handle), ...values });
    this.apply();
  }

  /**
   * Wait for the answer to an edit and return it. If the edit is refused, the assumed values are dropped.
   * @param {Promise<wire.EditAnswer>} request
   */
  async during(request) {
    this.busy++;
    try {
      const answer = await request;
      this.reached = Math.max(this.reached, answer.revision ?? 0);
      return answer;
    } catch (error) {
      this.clear();
      throw error;
    } finally {
      this.busy--;
      this.settle();
    }
  }

  // The node has sent the objects of `revision`: apply the assumed values to them, unless they contain all of them.
  tell(revision) {
    this.known = revision;
    this.settle();
    this.apply();
  }

  // Drop the assumed values if all edits are answered and sent. An answer may come before or after the changed objects.
  settle() {
    if (!this.busy && this.known >= this.reached) this.clear();
  }

  apply() {
    for (const [handle, matrix] of this.matrices) this.show(handle, { matrix });
    for (const [handle, values] of this.values) this.show(handle, { values: { ...this.objects.get(handle)?.values, ...values } });
  }

  show(handle, assumed) {
    const one = this.objects.get(handle);
    if (!one) return;
    if (this.told.get(handle)?.one !== one) this.told.set(handle, { one, matrix: one.matrix, values: one.values });
    Object.assign(one, assumed);
  }
}
