// What floats over the scene: pictures of cameras, and what scripts open: views, dialogs, consoles. All text is text.
const LINE_FEED = 10;

export class Windows {
  constructor(parent, socket) {
    this.parent = parent;
    this.socket = socket; // { ask, say }
    this.open = new Map(); // windows, by kind and handle or topic
    this.labels = new Map(); // of views, by topic
  }

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
    for (const [key, { element }] of this.open) {
      if (!key.startsWith(`${kind} `) || keys.has(key)) continue;
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
    if (onClose) header.append(create("button", { textContent: "×", title: "Close", onclick: onClose }));
    header.onpointerdown = (event) => event.target.tagName !== "BUTTON" && drag(element, header, event);
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
    const field = typed === null ? null : create("input", { value: typed, ariaLabel: title });
    const press = (button) => this.socket.ask("answer", { handle, button, typed: field?.value ?? "" }).catch(() => {});
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
    element.append(image, note);
    return { element, image, note, title: element.querySelector("span") };
  }

  // A picture is answered for when it is on the screen; only then the node sends another.
  picture(message) {
    const bytes = new Uint8Array(message);
    const end = bytes.indexOf(LINE_FEED);
    const said = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
    const shown = () => requestAnimationFrame(() => this.socket.say({ shown: said.picture }));
    const there = this.open.get(`picture ${said.picture}`);
    if (!there) return shown();
    const address = URL.createObjectURL(new Blob([bytes.subarray(end + 1)]));
    there.image.onload = there.image.onerror = () => {
      URL.revokeObjectURL(address);
      shown();
    };
    there.image.src = address;
    there.title.textContent = this.labels.get(said.picture) ?? said.name;
    there.note.textContent = said.note;
  }
}

function create(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

function drag(element, handle, { pointerId, clientX, clientY }) {
  const [x, y] = (element.style.translate || "0px 0px").split(" ").map(parseFloat);
  handle.setPointerCapture(pointerId);
  handle.onpointermove = (event) => {
    element.style.translate = `${x + event.clientX - clientX}px ${(y || 0) + event.clientY - clientY}px`;
  };
  handle.onpointerup = handle.onpointercancel = () => (handle.onpointermove = null);
}
