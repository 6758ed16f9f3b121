// What the simulation says, and its script with it, under the script: counts instead of repeats.
const MOST = 200; // lines
const RECENT = 5; // lines among which one is sought that says the same

export class Console {
  constructor(list) {
    this.list = list;
  }

  add(line) {
    const same = line.startsWith("warning: ") ? line.replace(/\d+/g, "0") : line; // "step late by 80 ms (3 so far)"
    const follows = this.list.scrollTop + this.list.clientHeight >= this.list.scrollHeight - 20;
    let item = [...this.list.children].slice(-RECENT).find((one) => one.same === same);
    if (!item) {
      item = Object.assign(document.createElement("li"), { same, times: 0 });
      this.list.append(item);
    }
    item.times += 1;
    item.className = /^(warning|error): /.exec(line)?.[1] ?? "";
    item.textContent = item.times > 1 ? `${line}  (${item.times} times)` : line;
    while (this.list.children.length > MOST) this.list.firstElementChild.remove();
    if (follows) this.list.scrollTop = this.list.scrollHeight;
  }

  clear() {
    this.list.replaceChildren();
  }
}
