// A menu below a button, for mouse and keyboard.
export class Menu {
  // `button` shows and hides `list`; the items are the children with the role menuitem.
  constructor(button, list) {
    this.button = button;
    this.list = list;
    button.onclick = () => this.show(this.list.hidden);
    button.onkeydown = (event) => {
      if (event.key !== "ArrowDown") return;
      event.preventDefault();
      this.show(true);
    };
    list.addEventListener("keydown", (event) => this.key(event));
    list.addEventListener("click", (event) => event.target.closest("[role=menuitem]") && this.show(false));
    document.addEventListener("pointerdown", (event) => {
      if (!list.hidden && !list.contains(event.target) && !button.contains(event.target)) this.show(false);
    });
  }

  get items() {
    return [...this.list.querySelectorAll("[role=menuitem]:not(:disabled)")];
  }

  show(on) {
    this.list.hidden = !on;
    this.button.setAttribute("aria-expanded", String(on));
    if (on) this.items[0]?.focus();
  }

  key(event) {
    const { items } = this;
    const at = items.indexOf(document.activeElement);
    const to = { ArrowDown: at + 1, ArrowUp: at - 1, Home: 0, End: -1 }[event.key];
    if (to !== undefined) items.at(to % items.length)?.focus();
    else if (event.key === "Escape" || event.key === "Tab") this.show(false);
    else return;
    if (event.key === "Escape") this.button.focus();
    if (event.key !== "Tab") event.preventDefault();
    event.stopPropagation();
  }
}
