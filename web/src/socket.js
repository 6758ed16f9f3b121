// The page's WebSocket to the cockpit: requests with replies, and messages of the cockpit. It reconnects after a loss.
import { isWatching } from "./course.js";
import { SILENCE } from "./state/facts.js";

const AGAIN = [1000, 1000, 2000, 4000, 8000]; // ms before each further attempt; the last one is repeated
const REFUSED = 30_000; // ms between attempts while the cockpit refuses this page: only the user can change that
const ABANDON = 7 * SILENCE * 1000; // ms of silence after which the page connects again
const PATIENCE = 10_000; // ms for a connection to be opened
const FORBIDDEN = 403;
const RETURN = "return"; // relative to the page: gives a challenge, and takes its signature by a page that an earlier cockpit let in

const hex = (bytes) => [...new Uint8Array(bytes)].map((one) => one.toString(16).padStart(2, "0")).join("");

// Return the signature of a challenge, null if the browser cannot sign: it has crypto.subtle only on localhost and https.
async function sign(key, challenge) {
  if (!globalThis.crypto?.subtle) return null;
  const algorithm = { name: "HMAC", hash: "SHA-256" };
  const bytes = new Uint8Array(key.match(/../g).map((two) => parseInt(two, 16)));
  const imported = await crypto.subtle.importKey("raw", bytes, algorithm, false, ["sign"]);
  return hex(await crypto.subtle.sign("HMAC", imported, new TextEncoder().encode(challenge)));
}

export class PageSocket {
  // `on` has the callbacks tell(message), picture(bytes), open() and close(); the store gets the state of the connection.
  /**
   * @param {import("./state/store.js").Store} store
   * @param {{ tell: (message: wire.Told) => void, picture: (bytes: ArrayBuffer) => void, open: () => void, close: () => void }} on
   */
  constructor(store, on) {
    this.store = store;
    this.on = on;
    this.waiting = new Map();
    this.number = 0;
    this.attempts = 0;
    this.key = ""; // signs this page's return to the next cockpit on the port; never stored, and never sent
    this.begun = 0; // ms, start of the last attempt to connect
    this.socket = this.connect();
    setInterval(() => this.watch(), 500);
  }

  connect() {
    clearTimeout(this.later);
    const socket = new WebSocket(new URL(isWatching ? "socket?watch" : "socket", location.href).href.replace("http", "ws"), "drone_sim");
    this.begun = performance.now();
    socket.binaryType = "arraybuffer";
    socket.onopen = () => this.opened();
    socket.onmessage = ({ data }) => this.receive(data);
    socket.onclose = () => this.closed();
    return socket;
  }

  opened() {
    this.attempts = 0;
    this.store.take("connected");
    this.on.open();
  }

  receive(data) {
    this.store.take("heard");
    if (typeof data !== "string") return this.on.picture(data);
    const message = JSON.parse(data);
    if (message.pass) this.key = message.pass;
    const waiting = this.waiting.get(message.id);
    if (!waiting) return this.on.tell(message);
    this.waiting.delete(message.id);
    if (message.error) waiting.reject(Object.assign(new Error(message.error), { kind: message.kind, line: message.line }));
    else waiting.resolve(message);
  }

  closed() {
    const { connection } = this.store.now;
    for (const { reject } of this.waiting.values()) reject(new Error("the connection is lost"));
    this.waiting.clear();
    if (connection !== "refused") this.store.take("lost");
    if (connection === "connected") this.on.close();
    this.tryAgain(connection !== "connected");
  }

  // Connect again, after a longer wait with every attempt. If the cockpit may have refused this page, ask first to be let in.
  async tryAgain(mayBeRefused) {
    const attempt = this.attempts++;
    const answer = mayBeRefused ? await this.askToReturn() : "nobody";
    if (answer === "refused") this.store.take("refused");
    const wait = { refused: REFUSED, allowed: AGAIN[0], nobody: AGAIN[Math.min(attempt, AGAIN.length - 1)] }[answer];
    this.later = setTimeout(() => (this.socket = this.connect()), wait);
  }

  // Return "nobody" if no cockpit answers (a proxy may answer in its place), "allowed" if it lets this page in, else "refused".
  // It lets in a page that an earlier cockpit on this port let in, and which signs a challenge with the key of that cockpit.
  async askToReturn() {
    try {
      const answer = await fetch(RETURN, { signal: AbortSignal.timeout(PATIENCE) });
      if (answer.status === FORBIDDEN) return "refused";
      if (!answer.ok) return "nobody";
      const challenge = await answer.text();
      const signature = this.key && (await sign(this.key, challenge));
      if (!signature) return "refused";
      const signed = `${RETURN}?challenge=${challenge}&signature=${signature}`;
      return (await fetch(signed, { signal: AbortSignal.timeout(PATIENCE) })).ok ? "allowed" : "refused";
    } catch {
      return "nobody";
    }
  }

  // Replace a connection that is silent or does not open: the cockpit may be stopped, or the network has dropped it.
  watch() {
    this.store.take("tick");
    const { connection, heard, at } = this.store.now;
    const isSilent = connection === "connected" && at - heard > ABANDON;
    const isUnopened = this.socket.readyState === WebSocket.CONNECTING && at - this.begun > PATIENCE;
    if (!isSilent && !isUnopened) return;
    this.socket.onopen = this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
    this.closed();
  }

  get open() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  /** @type {wire.Ask} */
  ask(ask, more = {}) {
    if (!this.open) return Promise.reject(new Error("there is no connection"));
    const id = ++this.number;
    this.socket.send(JSON.stringify({ id, ask, ...more }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  /** @param {wire.Said} message */
  say(message) {
    if (this.open) this.socket.send(JSON.stringify(message));
  }

  /** @param {wire.Command} command */
  hold(command) {
    this.say({ hold: command });
  }
}
