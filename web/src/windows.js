// What floats over the scene: pictures of cameras, and what scripts open: views, dialogs, consoles. All text is text.
import { create, icon } from "./dom.js";
import { Overlay } from "./overlay.js";
import { Recorder } from "./recorder.js";

export class Windows {
  /**
   * @param {HTMLElement} parent
   * @param {import("./socket.js").PageSocket} socket
   * @param {import("./notice.js").Notice} notice
   */
  constructor(parent, socket, notice) {
    this.parent = parent;
    this.socket = socket; // { ask, say }
    this.notice = notice;
    this.open = new Map(); // windows, by kind and handle or topic
    this.labels = new Map(); // of views, by topic
  }

  /** @param {wire.Windows} windows */
  show({ views, dialogs, consoles }) {
    this.labels = new Map(views.map(({ topic, label }) => [topic, label]));
    const blind = views.filter(({ topic }) => !topic);
    this.keep("view", blind, (one) => this.blindView(one));
    this.keep("dialog", dialogs, (one) => this.dialog(one));
    this.keep("console", consoles, (one) => this.console(one));
  }

  clear() {
    this.show({ views: [], dialogs: [], consoles: [] });
    this.showPictures([]);
  }

  showPictures(topics) {
    this.keep("picture", topics.map((topic) => ({ handle: topic })), (one) => this.figure(one.handle));
  }

  // Leaves of one kind the windows that are listed; what is new is made, what has changed is filled anew.
  keep(kind, listed, make) {
    const keys = new Set(listed.map(({ handle }) => `${kind} ${handle}`));
    for (const [key, { element, end }] of this.open) {
      if (!key.startsWith(`${kind} `) || keys.has(key)) continue;
      end?.();
      element.remove();
      this.open.delete(key);
    }
    for (const one of listed) {
      const key = `${kind} ${one.handle}`;
      const now = JSON.stringify(one);
      const there = this.open.get(key);
      if (there?.now === now) continue;
      if (there?.fill) there.fill(one);
      else {
        const made = make(one);
        if (there) there.element.replaceWith(made.element);
        else this.parent.append(made.element);
        this.open.set(key, made);
      }
      this.open.get(key).now = now;
    }
  }

  frame(kind, title, onClose) {
    const element = create("section", { className: `window ${kind}` });
    const header = create("header", {}, create("span", { textContent: title, title }));
    if (onClose) header.append(create("button", { className: "plain", title: "Close", "aria-label": `Close ${title}`, onclick: onClose }, icon("close")));
    header.onpointerdown = (event) => event.target?.closest?.("button") || drag(element, header, event);
    element.append(header);
    return element;
  }

  blindView({ label, sensor }) {
    const element = this.frame("view", label);
    element.append(create("p", { textContent: `${sensor} takes no pictures` }));
    return { element };
  }

  dialog({ handle, title, text, buttons, typed }) {
    const element = this.frame("dialog", title);
    const field = typed === null ? null : create("input", { value: typed, "aria-label": title });
    const press = (button) => this.socket.ask("answer", { handle, button, typed: field?.value ?? "" }).catch((error) => this.notice.say(error.message, true));
    if (field) field.onkeydown = (event) => event.key === "Enter" && press(buttons[0]);
    element.append(create("p", { textContent: text }));
    if (field) element.append(field);
    element.append(create("div", {}, ...buttons.map((one) => create("button", { textContent: one, onclick: () => press(one) }))));
    return { element };
  }

  console({ title, lines }) {
    const element = this.frame("console", title);
    const text = create("pre", { tabIndex: 0 });
    const fill = (one) => {
      const follows = text.scrollTop + text.clientHeight >= text.scrollHeight - 20;
      text.textContent = one.lines.join("\n");
      if (follows) text.scrollTop = text.scrollHeight;
    };
    element.append(text);
    fill({ lines });
    return { element, fill };
  }

  figure(topic) {
    const element = this.frame("picture", topic, () => this.socket.ask("camera", { topic, on: false }).catch(() => {}));
    const image = create("img", { alt: topic });
    const note = create("p");
    const name = topic.replace(/\W+/g, "_").replace(/^_/, "");
    const film = create("button", { className: "plain", title: "Record a video of this camera", "aria-label": `Record ${topic}` }, icon("video"));
    const turn = (overlay, on) => this.socket.ask("overlay", { topic, overlay, on }).catch((error) => this.notice.say(error.message, true));
    const over = new Overlay(topic, turn);
    const made = { element, image, note, over, title: element.querySelector("span") };
    const recorder = new Recorder(film, () => this.film(made), name, this.notice, () => (made.canvas = null));
    made.end = () => recorder.stop(); // the film is saved
    element.querySelector("header button")?.before(...over.buttons, film);
    element.append(create("div", { className: "seen" }, image, over.svg), note, over.legend);
    return made;
  }

  // What a camera shows, as a stream: each picture is drawn on a canvas that nobody sees.
  film(figure) {
    figure.canvas = create("canvas", { width: figure.image.naturalWidth || 640, height: figure.image.naturalHeight || 480 });
    figure.canvas.getContext("2d").drawImage(figure.image, 0, 0, figure.canvas.width, figure.canvas.height);
    return figure.canvas.captureStream();
  }

  // A picture is answered for when it is on the screen; only then the node sends another.
  /**
   * @param {wire.Picture} said
   * @param {Uint8Array<ArrayBuffer>} bytes
   */
  picture(said, bytes) {
    const shown = () => requestAnimationFrame(() => this.socket.say({ shown: said.picture }));
    const there = this.open.get(`picture ${said.picture}`);
    if (!there) return shown();
    const address = URL.createObjectURL(new Blob([bytes]));
    there.image.onload = there.image.onerror = () => {
      const { canvas } = there;
      canvas?.getContext("2d").drawImage(there.image, 0, 0, canvas.width, canvas.height);
      URL.revokeObjectURL(address);
      there.over.show(said, there.image);
      shown();
    };
    there.image.src = address;
    there.title.textContent = this.labels.get(said.picture) ?? said.name;
    there.note.textContent = said.note;
  }
}

function drag(element, handle, { pointerId, clientX, clientY }) {
  const [x, y] = (element.style.translate || "0px 0px").split(" ").map(parseFloat);
  handle.setPointerCapture(pointerId);
  handle.onpointermove = (event) => {
    element.style.translate = `${x + event.clientX - clientX}px ${(y || 0) + event.clientY - clientY}px`;
  };
  handle.onpointerup = handle.onpointercancel = () => (handle.onpointermove = null);
}
