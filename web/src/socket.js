// Our socket: questions with answers, and what the node tells by itself. It comes back after the node has.
const AGAIN = 1000; // ms

export class PageSocket {
  constructor(onTell, onPicture, onOpen, onClose) {
    this.onTell = onTell;
    this.onPicture = onPicture;
    this.onOpen = onOpen;
    this.onClose = onClose;
    this.waiting = new Map();
    this.number = 0;
    this.connect();
  }

  connect() {
    this.socket = new WebSocket(`ws${location.protocol === "https:" ? "s" : ""}://${location.host}/socket`, "drone_sim");
    this.socket.onopen = () => this.onOpen();
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => (typeof data === "string" ? this.take(JSON.parse(data)) : this.onPicture(data));
    this.socket.onclose = () => {
      for (const { reject } of this.waiting.values()) reject(new Error("the connection is lost"));
      this.waiting.clear();
      this.onClose();
      setTimeout(() => this.connect(), AGAIN);
    };
  }

  take(message) {
    const waiting = this.waiting.get(message.id);
    if (!waiting) return this.onTell(message);
    this.waiting.delete(message.id);
    if (message.error) waiting.reject(Object.assign(new Error(message.error), { kind: message.kind, line: message.line }));
    else waiting.resolve(message);
  }

  get open() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  ask(ask, more = {}) {
    if (!this.open) return Promise.reject(new Error("there is no connection"));
    const id = ++this.number;
    this.socket.send(JSON.stringify({ id, ask, ...more }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }

  say(message) {
    if (this.open) this.socket.send(JSON.stringify(message));
  }

  hold(command) {
    this.say({ hold: command });
  }
}
