// The search for numbers in a line of a script.
const NUMBER = /(?<![\w.])(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?!\w)/gi;
const SIGN = /(?:^|[^\w\s)\]"']|\b(?:return|and|or|not|in|if|else))\s*([-+])$/; // ends in a unary sign

// Return the range { from, to } of the number at an index of the line, with its sign; null if there is no number.
export function numberAt(line, place) {
  for (const match of line.matchAll(NUMBER)) {
    const to = match.index + match[0].length;
    if (place < match.index || place > to) continue;
    return { from: match.index - (SIGN.test(line.slice(0, match.index)) ? 1 : 0), to };
  }
  return null;
}
