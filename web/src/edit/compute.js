// Parser for arithmetic in a number field: 2*pi, 0.5+0.1, -(3 - 1)/4, 2^3.
const TOKEN = /\s*(\d+\.?\d*(?:e[+-]?\d+)?|\.\d+(?:e[+-]?\d+)?|pi|π|[-+*/^()])/iy;

// Return the value of a text, NaN if it is not valid arithmetic.
export function compute(text) {
  const tokens = [];
  TOKEN.lastIndex = 0;
  for (let at = 0, end = text.trimEnd().length; at < end; at = TOKEN.lastIndex) {
    const match = TOKEN.exec(text);
    if (!match) return NaN;
    tokens.push(match[1].toLowerCase());
  }
  const value = sum(tokens);
  return tokens.length ? NaN : value; // tokens that are left over are an error
}

function sum(tokens) {
  let value = product(tokens);
  while (["+", "-"].includes(tokens[0])) value += tokens.shift() === "+" ? product(tokens) : -product(tokens);
  return value;
}

function product(tokens) {
  let value = signed(tokens);
  while (["*", "/"].includes(tokens[0])) value = tokens.shift() === "*" ? value * signed(tokens) : value / signed(tokens);
  return value;
}

function signed(tokens) {
  if (tokens[0] === "-") return -(tokens.shift(), signed(tokens));
  if (tokens[0] === "+") return tokens.shift(), signed(tokens);
  const base = atom(tokens);
  return tokens[0] === "^" ? (tokens.shift(), base ** signed(tokens)) : base;
}

function atom(tokens) {
  const token = tokens.shift();
  if (token === "pi" || token === "π") return Math.PI;
  if (token !== "(") return token === undefined ? NaN : Number(token);
  const value = sum(tokens);
  return tokens.shift() === ")" ? value : NaN;
}
