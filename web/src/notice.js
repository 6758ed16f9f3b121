// The message line, over the scene's lower edge: it moves nothing, and goes by itself; an error stays until the next
// action, or until it is put away.
const READ = 6000; // ms

export class Notice {
  constructor(element) {
    this.element = element;
    this.text = element.querySelector("span");
    element.querySelector("button").onclick = () => this.clear();
    this.clear();
  }

  say(line, bad = false) {
    clearTimeout(this.later);
    this.text.textContent = line;
    this.element.classList.toggle("bad", bad);
    this.element.classList.toggle("empty", !line);
    if (line && !bad) this.later = setTimeout(() => this.clear(), READ);
  }

  // A line that takes no error away.
  warn(line) {
    if (!this.element.classList.contains("bad")) this.say(line);
  }

  clear() {
    this.say("");
  }
}
