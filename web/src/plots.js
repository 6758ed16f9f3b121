// The charts of the last 30 s of flight: chosen by the user, in the panel or enlarged over the scene, saved as PNG or CSV.
import uPlot from "uplot";
import { at, create, iconButton, save, stamp } from "./dom.js";
import { keep, kept } from "./storage.js";

const AGAIN = 250; // ms between two requests for new values
const SECONDS = 30;
const FIRST = ["height", "velocity"];
const SMALL = 150; // px, height of a chart in the panel
const COLORS = ["--line-1", "--line-2", "--line-3", "--line-4", "--line-5", "--line-6"];
const DASHED = /, commanded$/;

const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const dark = matchMedia("(prefers-color-scheme: dark)");

// Return the labels of ticks, with as many digits as two neighboring ticks need to differ.
export function ticks(values) {
  const step = Math.abs(values[1] - values[0]) || 1;
  const digits = Math.max(0, Math.min(9, -Math.floor(Math.log10(step) + 1e-9)));
  const largest = Math.max(...values.map(Math.abs));
  if (largest >= 1e6 || digits > 5) return values.map((one) => one.toExponential(Math.max(0, Math.ceil(Math.log10(Math.max(largest, step) / step)))));
  return values.map((one) => (one === 0 ? (0).toFixed(digits) : one.toFixed(digits)));
}

// Return the range of an axis: all values and the range `least`, with a margin of 5 %, and never an empty range.
export function extent(low, high, least) {
  if (low === null || high === null || !Number.isFinite(low)) return least ?? [-1, 1];
  let [from, to] = least ? [Math.min(low, least[0]), Math.max(high, least[1])] : [low, high];
  if (to - from < 1e-9 * Math.max(Math.abs(to), 1e-3)) {
    const margin = Math.abs(to) * 0.1 || 1;
    return [from - margin, to + margin];
  }
  const margin = (to - from) * 0.05;
  return [from - margin, to + margin];
}

class Chart {
  /**
   * @param {wire.Chart} described
   * @param {() => void} close
   * @param {() => void} enlarge
   */
  constructor(described, close, enlarge) {
    this.described = described;
    this.run = 0;
    /** @type {wire.Rows["rows"]} */
    this.rows = [];
    const { title, unit } = described;
    this.name = unit ? `${title}, ${unit}` : title;
    this.large = iconButton("large", "Enlarge", enlarge);
    this.element = create(
      "figure", { className: "chart", role: "group", "aria-label": this.name },
      create("figcaption", {}, create("span", { textContent: this.name }), this.large,
        create("button", { textContent: "PNG", title: "Save the chart as a picture", type: "button", onclick: () => this.savePicture() }),
        create("button", { textContent: "CSV", title: "Save the numbers", type: "button", onclick: () => this.saveNumbers() }),
        iconButton("close", "Close", close)),
    );
    this.place = create("div", { className: "plot", onclick: enlarge });
    this.element.append(this.place);
    this.watch = new ResizeObserver(() => this.fit());
    this.watch.observe(this.place);
    this.chart = this.draw();
  }

  get size() {
    const isLarge = this.element.closest("#enlarged");
    const legend = this.place.querySelector(".u-legend")?.offsetHeight ?? 0;
    return { width: Math.max(this.place.clientWidth, 120), height: isLarge ? Math.max(this.place.clientHeight - legend, 100) : SMALL };
  }

  // Draw the chart again, in the colors of the current color scheme.
  paint() {
    this.chart.destroy();
    this.chart = this.draw();
  }

  draw() {
    const { lines, least } = this.described;
    const axis = { stroke: style("--ink-soft"), grid: { stroke: style("--grid"), width: 1 }, ticks: { show: false }, font: "11px system-ui", values: (_, splits) => ticks(splits) };
    /** @type {uPlot.Options} */
    const options = {
      ...this.size,
      scales: { x: { time: false, range: [-SECONDS, 0] }, y: { range: (_, low, high) => extent(low, high, least) } },
      axes: [{ ...axis, size: 24, space: 60 }, { ...axis, size: 46, space: 26 }],
      series: [
        { label: "t, s", value: (_, value) => (value === null ? "" : value.toFixed(2)) },
        ...lines.map((label, index) => ({
          label, stroke: style(COLORS[index % COLORS.length]), width: 1.75, spanGaps: false,
          dash: DASHED.test(label) ? [6, 4] : undefined, points: { show: false },
          value: (_, value) => (value ?? this.rows.at(-1)?.[index + 1])?.toPrecision(3) ?? "", // without a pointer, the last value
        })),
      ],
      cursor: { y: false, drag: { x: false, y: false } },
      legend: { live: true },
    };
    return new uPlot(options, this.columns, this.place);
  }

  /** @returns {uPlot.AlignedData} */
  get columns() {
    const now = this.rows.at(-1)?.[0] ?? 0;
    const times = this.rows.map(([time]) => time - now);
    return [times, ...this.described.lines.map((_, index) => this.rows.map((row) => row[index + 1]))];
  }

  fit() {
    const { width, height } = this.size;
    if (width !== this.chart.width || height !== this.chart.height) this.chart.setSize({ width, height });
  }

  /** @param {wire.Rows} told */
  take({ run, rows }) {
    if (run !== this.run) this.rows = [];
    this.run = run;
    if (!rows.length) return;
    this.rows.push(...rows);
    const from = rows[rows.length - 1][0] - SECONDS;
    const first = this.rows.findIndex(([time]) => time >= from);
    if (first > 0) this.rows.splice(0, first);
    if (document.hidden) return;
    this.chart.setData(this.columns);
  }

  get last() {
    return [this.run, this.rows.at(-1)?.[0] ?? -1];
  }

  get file() {
    return `${this.described.title.replace(/\W+/g, "_")}-${stamp()}`;
  }

  saveNumbers() {
    const { lines, unit } = this.described;
    const quote = (text) => `"${text.replace(/"/g, '""')}"`;
    const head = ["t, s", ...lines.map((one) => (unit ? `${one}, ${unit}` : one))].map(quote);
    const first = this.rows[0]?.[0];
    const rows = this.rows.map(([time, ...values]) => [(time - first).toFixed(3), ...values]);
    const text = [head, ...rows].map((row) => row.join(",")).join("\n");
    save(new Blob([`${text}\n`], { type: "text/csv" }), `${this.file}.csv`);
  }

  // Save the chart as PNG, with its title, a legend of its colors, and a background.
  savePicture() {
    const from = this.chart.ctx.canvas;
    const ratio = from.width / this.chart.width;
    const head = 44 * ratio;
    const canvas = create("canvas", { width: from.width, height: from.height + head });
    const ink = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    ink.fillStyle = style("--surface");
    ink.fillRect(0, 0, canvas.width, canvas.height);
    ink.drawImage(from, 0, head);
    ink.font = `600 ${13 * ratio}px system-ui`;
    ink.fillStyle = style("--ink");
    ink.fillText(this.name, 8 * ratio, 16 * ratio);
    ink.font = `${11 * ratio}px system-ui`;
    let x = 8 * ratio;
    for (const [index, line] of this.described.lines.entries()) {
      ink.fillStyle = style(COLORS[index % COLORS.length]);
      ink.fillRect(x, 28 * ratio, 12 * ratio, 3 * ratio);
      ink.fillStyle = style("--ink");
      ink.fillText(line, x + 16 * ratio, 33 * ratio);
      x += ink.measureText(line).width + 32 * ratio;
    }
    canvas.toBlob((blob) => save(blob, `${this.file}.png`));
  }

  remove() {
    this.watch.disconnect();
    this.chart.destroy();
    this.element.remove();
  }
}

export class Plots {
  /**
   * @param {import("./board.js").Board} board
   * @param {wire.Ask} ask
   */
  constructor(board, ask) {
    this.ask = ask;
    this.board = board;
    this.charts = new Map(); // the charts that are drawn, by name
    this.isOpen = false;
    board.on("charts", () => this.offer());
    dark.addEventListener("change", () => this.charts.forEach((one) => one.paint()));
    setInterval(() => this.look(), AGAIN);
  }

  get chosen() {
    return kept("plots", FIRST);
  }

  // Open or close the panel. Charts are drawn while it is open, and while they are enlarged.
  show(isOpen) {
    this.isOpen = isOpen;
    this.offer();
  }

  offer() {
    const all = this.board.get("charts", []);
    const rows = all.map(({ chart, title, unit }) => {
      const box = create("input", { type: "checkbox", checked: this.chosen.includes(chart) });
      box.onchange = () => this.choose(chart, box.checked);
      return create("label", { title: unit ? `in ${unit}` : "" }, box, title);
    });
    at("plot-list").replaceChildren(...(rows.length ? rows : ["There is nothing to plot."]));
    for (const [name, chart] of this.charts) {
      const offered = all.find((one) => one.chart === name);
      const isSame = offered && JSON.stringify(offered) === JSON.stringify(chart.described);
      const isWanted = this.chosen.includes(name) && (this.isOpen || chart.element.closest("#enlarged"));
      if (!isSame || !isWanted) this.drop(name);
    }
    for (const described of this.isOpen ? all : []) {
      if (this.chosen.includes(described.chart) && !this.charts.has(described.chart)) this.add(described);
    }
  }

  choose(name, on) {
    keep("plots", on ? [...this.chosen, name] : this.chosen.filter((one) => one !== name));
    this.offer();
  }

  add(described) {
    const name = described.chart;
    const chart = new Chart(described, () => this.choose(name, false), () => this.enlarge(name));
    this.charts.set(name, chart);
    at("plot-charts").append(chart.element);
    chart.fit();
    this.look();
  }

  enlarge(name) {
    const { element, large } = this.charts.get(name);
    const isLarge = Boolean(element.closest("#enlarged"));
    at(isLarge ? "plot-charts" : "enlarged").append(element);
    large.title = isLarge ? "Enlarge" : "Back to the panel";
    large.setAttribute("aria-label", large.title);
    at("enlarged").hidden = !at("enlarged").children.length;
    this.offer();
    this.charts.get(name)?.fit();
  }

  drop(name) {
    this.charts.get(name).remove();
    this.charts.delete(name);
    at("enlarged").hidden = !at("enlarged").children.length;
  }

  async look() {
    if (!this.charts.size || this.asking) return;
    this.asking = true;
    const known = Object.fromEntries([...this.charts].map(([name, chart]) => [name, chart.last]));
    const { charts } = await this.ask("plots", { charts: known }).catch(() => ({ charts: {} }));
    this.asking = false;
    for (const [name, found] of Object.entries(charts)) this.charts.get(name)?.take(found);
  }
}
