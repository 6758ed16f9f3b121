// What has been asked for, and is not told yet: until then it counts, or a second number that one writes would bring
// back the first as it was.
export class Assumed {
  constructor(objects) {
    this.objects = objects;
    this.busy = 0; // edits that are not answered
    this.clear();
  }

  clear() {
    this.reached = 0; // the revision of the last answer
    this.matrices = new Map(); // of the world, by handle
    this.values = new Map(); // by handle
  }

  put(handle, matrix) {
    const way = matrix.clone().multiply(this.objects.get(handle).matrix.clone().invert());
    for (const one of this.objects.withBelow(handle)) this.matrices.set(one, way.clone().multiply(this.objects.get(one).matrix));
    this.apply();
  }

  set(handle, values) {
    this.values.set(handle, { ...this.values.get(handle), ...values });
    this.apply();
  }

  // Hears of an edit; returns its answer.
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
    }
  }

  // Hears what the node tells, up to this revision.
  told(revision) {
    if (!this.busy && revision >= this.reached) this.clear();
    else this.apply();
  }

  apply() {
    for (const [handle, matrix] of this.matrices) if (this.objects.get(handle)) this.objects.get(handle).matrix = matrix;
    for (const [handle, values] of this.values) {
      const one = this.objects.get(handle);
      if (one) one.values = { ...one.values, ...values };
    }
  }
}
