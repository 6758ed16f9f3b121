// Manual control by keys, touch sticks and gamepads. Changes of keys and sticks are sent at once; nonzero commands are repeated.
const SPEED = 1; // m/s, rad/s
const FAST = 2.5; // factor while Shift is held
const AGAIN = 100; // ms between two commands
const DEAD = 0.1; // dead zone of a gamepad's axes, which go from -1 to 1
// key_teleop has the same keys (KEY_MAPS in src/drone_sim/ros/tools/commands.py), which a test checks.
const KEYS = {
  KeyW: ["vx", 1], KeyS: ["vx", -1], KeyA: ["vy", 1], KeyD: ["vy", -1], KeyQ: ["wz", 1], KeyE: ["wz", -1],
  KeyR: ["vz", 1], KeyF: ["vz", -1], ArrowUp: ["vx", 1], ArrowDown: ["vx", -1], ArrowLeft: ["vy", 1], ArrowRight: ["vy", -1],
};
const PAD = { vx: [3, -1], vy: [2, -1], vz: [1, -1], wz: [0, -1] }; // the standard gamepad's axes: down and right are +1
const AXES = ["vx", "vy", "vz", "wz"];

// Show the letters that this keyboard has at the positions of W, A, S and D, because the positions count: a French keyboard
// has Z, Q, S and D there. Only Chromium knows the letters, and only on localhost or by https.
export async function nameKeys(elements) {
  const letters = await navigator.keyboard?.getLayoutMap?.().catch(() => {});
  for (const element of elements) element.textContent = letters?.get(`Key${element.textContent}`)?.toUpperCase() ?? element.textContent;
}

export class Teleop {
  constructor(hold, show) {
    this.hold = hold;
    this.show = show;
    this.keys = new Set();
    this.sticks = { vx: 0, vy: 0, vz: 0, wz: 0 };
    this.said = "{}";
    setInterval(() => this.tell(true), AGAIN);
  }

  // Listen to the keys of the page, except in fields, texts, bars and the start page; sliders and trees keep their arrow keys.
  listenTo(window) {
    const writes = (target) => target.closest?.("input:not([type=checkbox], [type=radio]), textarea, select, article, [contenteditable], [role=separator]");
    const takes = ({ code, target }) => window.document.querySelector("#start-page[open]") || writes(target) || (code.startsWith("Arrow") && target.closest?.("[role=slider], [role=tree]"));
    window.addEventListener("keydown", (event) => {
      if (event.key === "Shift") this.fast = true;
      if (!(event.code in KEYS) || takes(event) || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      this.keys.add(event.code);
      this.tell();
    }, true);
    window.addEventListener("keyup", (event) => {
      if (event.key === "Shift") this.fast = false;
      this.keys.delete(event.code);
      this.tell();
    }, true);
    window.addEventListener("blur", () => this.release());
    window.document.addEventListener("visibilitychange", () => this.release());
  }

  release() {
    this.keys.clear();
    this.fast = false;
    this.tell();
  }

  stick(element, across, along) {
    const knob = element.firstElementChild;
    const move = (x, y) => {
      const length = Math.max(1, Math.hypot(x, y));
      this.sticks[across] = -x / length;
      this.sticks[along] = -y / length;
      knob.style.transform = `translate(${(30 * x) / length}px, ${(30 * y) / length}px)`;
      this.tell();
    };
    const follow = (event) => {
      const box = element.getBoundingClientRect();
      move((2 * (event.clientX - box.left)) / box.width - 1, (2 * (event.clientY - box.top)) / box.height - 1);
    };
    element.addEventListener("pointerdown", (event) => {
      element.setPointerCapture(event.pointerId);
      follow(event);
    });
    element.addEventListener("pointermove", (event) => event.buttons && follow(event));
    for (const end of ["pointerup", "pointercancel"]) element.addEventListener(end, () => move(0, 0));
  }

  command() {
    const command = { ...this.sticks };
    for (const code of this.keys) command[KEYS[code][0]] += KEYS[code][1];
    for (const pad of navigator.getGamepads?.() ?? []) {
      if (!pad) continue;
      for (const axis of AXES) {
        const value = pad.axes[PAD[axis][0]] ?? 0;
        if (Math.abs(value) > DEAD) command[axis] += PAD[axis][1] * value;
      }
    }
    const speed = SPEED * (this.fast ? FAST : 1);
    for (const axis of AXES) command[axis] = Math.max(-1, Math.min(1, command[axis])) * speed + 0;
    return command;
  }

  tell(again = false) {
    const command = this.command();
    const text = JSON.stringify(command);
    const moves = AXES.some((axis) => command[axis]);
    if (text === this.said && !(again && moves)) return;
    this.said = text;
    this.hold(command);
    this.show(command);
  }
}
