// The windows over the scene: camera pictures, and views, dialogs and consoles of scripts. No text is read as HTML.
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
    this.labels = new Map(); // labels of views, by topic
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

  // Update the windows of one kind: remove those that are not listed, create new ones, refill or replace changed ones.
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
      const existing = this.open.get(key);
      if (existing?.now === now) continue;
      if (existing?.fill) existing.fill(one);
      else {
        const created = make(one);
        if (existing) existing.element.replaceWith(created.element);
        else this.parent.append(created.element);
        this.open.set(key, created);
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
    const figure = { element, image, note, over, title: element.querySelector("span") };
    const recorder = new Recorder(film, () => this.film(figure), name, this.notice, () => (figure.canvas = null));
    figure.end = () => recorder.stop(); // saves the video
    element.querySelector("header button")?.before(...over.buttons, film);
    element.append(create("div", { className: "seen" }, image, over.svg), note, over.legend);
    return figure;
  }

  // Return a stream of a camera's pictures, which are drawn on a canvas outside the page.
  film(figure) {
    figure.canvas = create("canvas", { width: figure.image.naturalWidth || 640, height: figure.image.naturalHeight || 480 });
    figure.canvas.getContext("2d").drawImage(figure.image, 0, 0, figure.canvas.width, figure.canvas.height);
    return figure.canvas.captureStream();
  }

  // Show a camera's picture, and acknowledge it once it is on the screen; the cockpit sends the next one only then.
  /**
   * @param {wire.Picture} header
   * @param {Uint8Array<ArrayBuffer>} bytes
   */
  picture(header, bytes) {
    const acknowledge = () => requestAnimationFrame(() => this.socket.say({ shown: header.picture }));
    const figure = this.open.get(`picture ${header.picture}`);
    if (!figure) return acknowledge();
    const address = URL.createObjectURL(new Blob([bytes]));
    figure.image.onload = figure.image.onerror = () => {
      const { canvas } = figure;
      canvas?.getContext("2d").drawImage(figure.image, 0, 0, canvas.width, canvas.height);
      URL.revokeObjectURL(address);
      figure.over.show(header, figure.image);
      acknowledge();
    };
    figure.image.src = address;
    figure.title.textContent = this.labels.get(header.picture) ?? header.name;
    figure.note.textContent = header.note;
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
