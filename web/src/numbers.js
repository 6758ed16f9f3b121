// Numbers in a line of a script.
const NUMBER = /(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?!\w)/gi;
const SIGN = /(?:^|[^\w\s)\]"']|\b(?:return|and|or|not|in|if|else))\s*([-+])$/; // a sign that does not subtract

// Returns { from, to } of the number that a place in the line touches, with its sign and its point; null for none.
export function numberAt(line, place) {
  for (const found of line.matchAll(NUMBER)) {
    const to = found.index + found[0].length;
    if (place < found.index || place > to) continue;
    return { from: found.index - (SIGN.test(line.slice(0, found.index)) ? 1 : 0), to };
  }
  return null;
}
