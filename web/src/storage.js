// Values that the browser stores for the page. A value that it cannot store is kept until the page is closed.
// Behind a proxy, several cockpits have the same origin, each with its own path; without one, the prefix is drone_sim/.
const PREFIX = `drone_sim${new URL(".", location.href).pathname}`;
const unstored = new Map(); // values that the browser could not store, by key, as text

function read(key) {
  try {
    return unstored.get(key) ?? localStorage.getItem(PREFIX + key);
  } catch {
    return null; // this browser has no storage
  }
}

// Return a stored value, or `otherwise` if there is none or it is not JSON.
export function kept(key, otherwise) {
  try {
    return JSON.parse(read(key)) ?? otherwise;
  } catch {
    return otherwise;
  }
}

export function keep(key, value) {
  const text = JSON.stringify(value);
  try {
    localStorage.setItem(PREFIX + key, text);
    unstored.delete(key); // another tab may change the value from now on
  } catch {
    unstored.set(key, text); // the storage is full, or there is none
  }
}

export function forget(key) {
  unstored.delete(key);
  try {
    localStorage.removeItem(PREFIX + key);
  } catch {
    // This browser has no storage.
  }
}

// Return the keys that begin with `prefix`, each without the prefix.
export function keysBelow(prefix) {
  let stored = [];
  try {
    stored = Object.keys(localStorage).filter((key) => key.startsWith(PREFIX)).map((key) => key.slice(PREFIX.length));
  } catch {
    // This browser has no storage.
  }
  const all = new Set([...stored, ...unstored.keys()]);
  return [...all].filter((key) => key.startsWith(prefix)).map((key) => key.slice(prefix.length));
}

// Return whether the browser has stored `value`, so that it survives the closing of the page.
export function isStored(key, value) {
  try {
    return localStorage.getItem(PREFIX + key) === JSON.stringify(value);
  } catch {
    return false;
  }
}
