"use strict";
// Pictures of signals over time, and of the output over the input. `colour`, `axis`, `room` and `widthOf` are those of the report
// (chart.js). The server reduces each part to what a picture can show, so a zoom asks it for the part.

const number = (value) => (value === null || value === undefined ? "-" : String(Number(value.toPrecision(4))));
const labelled = (name, unit) => (unit ? `${name} [${unit}]` : name);

const SHADES = ["ink", "blue", "before", "explained", "outside-class", "faint"];
const STYLES = { simulated: { colour: "after", dash: [6, 3] }, residual: { colour: "after" } };

class Plots {
  // `which`: record or other, as the server calls them.
  constructor(host, which) {
    Object.assign(this, { host, which, charts: [], experiment: 0, range: [0, Infinity] });
    this.bar = document.createElement("div");
    this.bar.className = "controls";
    this.select = document.createElement("select");
    this.row = document.createElement("label");
    this.row.append("Experiment ", this.select);
    this.select.addEventListener("change", () => {
      Object.assign(this, { experiment: Number(this.select.value), range: [0, Infinity] });
      this.load();
    });
    const group = document.createElement("span");
    group.className = "group";
    group.setAttribute("role", "group");
    group.setAttribute("aria-label", "Part of the record");
    const steps = [["◀", "Earlier", () => this.move(-0.5)], ["▶", "Later", () => this.move(0.5)], ["+", "Zoom in", () => this.scale(0.5)],
      ["−", "Zoom out", () => this.scale(2)], ["Whole record", "Whole record", () => this.zoom(0, Infinity)]];
    for (const [text, title, action] of steps) {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: text, title });
      button.setAttribute("aria-label", title);
      button.addEventListener("click", action);
      group.append(button);
    }
    this.bar.append(this.row, group);
    this.area = document.createElement("div");
    this.area.className = "plots";
    host.replaceChildren(this.bar, this.area);
    all.set(which, this);
  }

  async load() {
    const [from, to] = this.range;
    const path = `signals/${this.which}?experiment=${this.experiment}&from=${from}&to=${to}`;
    this.part = await ask(path);
    const { experiments } = this.part;
    if (this.select.length !== experiments)
      this.select.replaceChildren(...Array.from({ length: experiments }, (_, k) => new Option(String(k), k)));
    this.select.value = this.experiment;
    this.row.hidden = experiments < 2;
    this.draw();
  }

  length() { return Math.max(this.part.samples - 1, 1) / this.part.rate; }

  zoom(from, to) {
    const whole = this.length(), width = Math.min(Math.max(to - from, 8 / this.part.rate), whole);
    const start = Math.min(Math.max(from, 0), whole - width);
    this.range = [start, start + width];
    return attempt(this.which, () => this.load());
  }

  visible() { return [this.range[0], Math.min(this.range[1], this.length())]; }

  move(part) {
    const [from, to] = this.visible(), step = part * (to - from);
    return this.zoom(from + step, to + step);
  }

  scale(factor) {
    const [from, to] = this.visible(), middle = 0.5 * (from + to), half = 0.5 * factor * (to - from);
    return this.zoom(middle - half, middle + half);
  }

  // The lines of each picture: measured and simulated outputs together, else the signals of one kind and unit.
  groups() {
    const found = new Map();
    for (const line of this.part.lines) {
      const together = this.which === "other" && ["output", "simulated"].includes(line.kind);
      const key = together ? "output " + line.name : `${line.kind} ${line.unit}` + (line.kind === "residual" ? line.name : "");
      if (!found.has(key)) found.set(key, []);
      found.get(key).push({ ...line, label: together ? (line.kind === "output" ? "measured" : "simulated") : line.name });
    }
    // the simulated output is drawn over the measured one
    for (const lines of found.values()) lines.sort((one, other) => (one.kind === "simulated") - (other.kind === "simulated"));
    return [...found.values()];
  }

  draw() {
    for (const chart of this.charts) chart.destroy();
    const work = [...this.groups().map((lines) => (cell) => this.overTime(lines, cell)),
      ...this.part.loops.map((loop) => (cell) => this.loop(loop, cell))];
    // all cells first, because their number decides how wide they are
    const cells = work.map(() => Object.assign(document.createElement("div"), { role: "img" }));
    this.area.replaceChildren(...cells);
    this.charts = work.map((draw, i) => draw(cells[i]));
  }

  overTime(lines, cell) {
    const [first] = lines, names = [...new Set(lines.map((one) => one.name))].join(", ");
    const what = { input: "Input", output: "Output", covariate: "Other column", residual: "Residual of", simulated: "Simulated" }[first.kind];
    const title = new Set(lines.map((one) => one.kind)).size > 1 ? `${first.name}: measured and simulated` : `${what} ${names}`;
    cell.setAttribute("aria-label", title + " over time");
    const series = lines.map((one, i) => {
      const style = STYLES[one.kind] ?? {};
      return { label: one.label, stroke: colour(style.colour ?? SHADES[i % SHADES.length]), width: 1.2, dash: style.dash,
        points: { show: false }, value: (_, value) => number(value) };
    });
    return new uPlot({
      title, width: widthOf(cell), height: 220,
      series: [{ label: "time [s]", value: (_, value) => number(value) }, ...series],
      cursor: { y: false, sync: { key: this.which }, drag: { x: true, y: false, setScale: false },
        bind: { dblclick: () => () => { this.zoom(0, Infinity); return null; } } },
      scales: { x: { time: false, range: (_, low, high) => [low, high] } },
      axes: [axis("time [s]", { size: 40 }), axis(labelled(first.kind === "residual" ? "residual" : names, first.unit), { size: room })],
      hooks: { setSelect: [(plot) => this.selected(plot)] },
    }, [this.part.time, ...lines.map((one) => one.values)], cell);
  }

  selected(plot) {
    const { left, width } = plot.select;
    if (width < 3) return;
    plot.setSelect({ left: 0, width: 0 }, false);
    this.zoom(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
  }

  // The output over the input: as points, because they are thinned out.
  loop({ input, output, x, y }, cell) {
    const [from, to] = [this.part.lines[input], this.part.lines[output]];
    cell.setAttribute("aria-label", `${to.name} over ${from.name}`);
    const points = (plot, index) => {
      const size = devicePixelRatio * 2, path = new Path2D(), [xs, ys] = plot.data[index];
      for (let i = 0; i < xs.length; i++) {
        if (xs[i] === null || ys[i] === null) continue;
        path.rect(plot.valToPos(xs[i], "x", true) - size / 2, plot.valToPos(ys[i], "y", true) - size / 2, size, size);
      }
      plot.ctx.fillStyle = colour("blue");
      plot.ctx.fill(path);
      return null;
    };
    const span = (values) => () => {
      const low = Math.min(...values.filter((v) => v !== null)), high = Math.max(...values.filter((v) => v !== null));
      const margin = 0.05 * (high - low) || Math.abs(high) || 1;
      return [low - margin, high + margin];
    };
    return new uPlot({
      mode: 2, title: `${to.name} over ${from.name}`, width: widthOf(cell), height: 252, legend: { show: false },
      cursor: { show: false }, series: [null, { paths: points }],
      scales: { x: { time: false, auto: false, range: span(x) }, y: { auto: false, range: span(y) } },
      axes: [axis(labelled(from.name, from.unit), { size: 40 }), axis(labelled(to.name, to.unit), { size: room })],
    }, [null, [x, y]], cell);
  }
}

const all = new Map();
function redraw() { for (const plots of all.values()) if (plots.part) plots.draw(); }
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
let width = innerWidth;
addEventListener("resize", () => {
  if (innerWidth === width) return;
  width = innerWidth;
  requestAnimationFrame(redraw);
});
