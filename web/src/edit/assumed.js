// What has been asked for, and is not told yet: until then it counts, or a second number that one writes would bring
// back the first as it was.
export class Assumed {
  /** @param {import("./objects.js").Objects} objects */
  constructor(objects) {
    this.objects = objects;
    this.busy = 0; // edits that are not answered
    this.known = 0; // the revision that has been told
    this.told = new Map(); // what has been told of objects that are shown otherwise, by handle
    this.reached = 0; // the revision of the last answer
    /** @type {Map<number, import("three").Matrix4>} */
    this.matrices = new Map(); // of the world, by handle
    /** @type {Map<number, Record<string, any>>} */
    this.values = new Map(); // by handle
  }

  // Lets what has been told be seen.
  clear() {
    for (const { one, ...told } of this.told.values()) Object.assign(one, told);
    this.reached = 0;
    for (const all of [this.matrices, this.values, this.told]) all.clear();
  }

  put(handle, matrix) {
    const way = matrix.clone().multiply(this.objects.existing(handle).matrix.clone().invert());
    for (const one of this.objects.withBelow(handle)) this.matrices.set(one, way.clone().multiply(this.objects.existing(one).matrix));
    this.apply();
  }

  set(handle, values) {
    this.values.set(handle, { ...this.values.get(handle), ...values });
    this.apply();
  }

  /**
   * Hears of an edit; returns its answer.
   * @param {Promise<wire.EditAnswer>} asked
   */
  async during(asked) {
    this.busy++;
    try {
      const answer = await asked;
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

  // Hears what the node tells, up to this revision.
  tell(revision) {
    this.known = revision;
    this.settle();
    this.apply();
  }

  // The answer to an edit may come before the node tells of it, or after that.
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
