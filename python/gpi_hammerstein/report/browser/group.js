// The linked pictures of one output of one experiment: what is visible, and where the pointer is.

const SHORTEST = 8; // samples in a picture

class Group {
  constructor(experiment, output, hidden) {
    Object.assign(this, { experiment, output, hidden });
    this.duration = Math.max(experiment.samples - 1, 1) / experiment.rate;
    this.range = [0, this.duration];
    this.charts = [];
    this.pointing = false;
    const what = stored.outputs[output], o = output, { name, unit } = what;
    const narrow = innerWidth < 800 || printing();
    const one = (kind, signal, width, shade, dash) => ({ kind, name: signal + o, label: kind, width, dash, colour: shade });
    const outputs = [one("before", "before", 1.5, colour("before")), one("measured", "measured", 1.5, colour("ink")),
      one("after", "after", 1.2, colour("after"), [6, 3])];
    const band = { name: "after" + o, half: what.half_band, colour: colour("band") };
    const errors = [one("before", "errorBefore", 1, colour("before")), one("after", "errorAfter", 1, colour("after"))];
    const limit = experiment.limits[o];
    // a few wrong samples, and the start, do not determine the axis of the whole record
    const clipped = (low, high) => {
      this.clipped = this.isWhole() && (low < -limit || high > limit);
      return this.clipped ? [Math.max(low, -limit), Math.min(high, limit)] : [low, high];
    };
    const [lowest, highest] = experiment.spans[o];
    const within = (low, high) => this.isWhole() ? [Math.max(low, lowest), Math.min(high, highest)] : [low, high];
    const add = (id, options) => {
      const host = document.getElementById(id);
      this.charts.push(new TimeChart(host, this, options));
    };
    add("chart-output", { title: `${name}: measured, and simulated before and after`, label: labelled(name, unit),
      lines: outputs, band, height: narrow ? 230 : 270, range: within });
    add("chart-detail", { title: "The part with the largest error after", label: labelled(name, unit), lines: outputs, band,
      height: narrow ? 230 : 270, detail: this.largest() });
    // the band is that of the measured output around the simulated one
    add("chart-residual", { title: `Residual of ${name}: measured minus simulated`, label: labelled("residual", unit), lines: errors,
      height: narrow ? 190 : 210, range: clipped });
    const channels = [...stored.inputs.map((own, i) => ({ ...own, signal: "input" + i })),
      ...stored.covariates.map((own, i) => ({ ...own, signal: "covariate" + i }))];
    const shades = ["ink", "blue", "before", "explained", "outside-class", "faint"];
    const units = new Set(channels.map((own) => own.unit));
    add("chart-inputs", { title: channels.map((own) => own.name).join(", "),
      label: labelled(channels.length === 1 ? channels[0].name : "inputs", units.size === 1 ? [...units][0] : ""),
      lines: channels.map((own, i) => ({ kind: own.signal, name: own.signal, label: own.name, width: 1,
        colour: colour(shades[i % shades.length]) })), height: narrow ? 150 : 160 });
    this.channels = channels;
    this.update();
  }

  isWhole() { return this.range[0] <= 0 && this.range[1] >= this.duration; }

  largest() {
    const [first, last] = this.experiment.largest[this.output];
    return [first, last - 1].map((sample) => sample / this.experiment.rate);
  }

  // Shows the part between two times, at least some samples long and inside the experiment.
  zoom(from, to) {
    const length = Math.min(this.duration, Math.max(to - from, SHORTEST / this.experiment.rate));
    const start = Math.min(Math.max(0.5 * (from + to - length), 0), this.duration - length);
    this.range = [start, start + length];
    this.update();
  }

  whole() { this.zoom(0, this.duration); }

  // Zooms around the middle by a factor, or moves by a part of the visible length.
  scale(factor) {
    const [from, to] = this.range, middle = 0.5 * (from + to), half = 0.5 * factor * (to - from);
    this.zoom(middle - half, middle + half);
  }

  move(part) {
    const [from, to] = this.range, step = part * (to - from);
    this.zoom(from + step, to + step);
  }

  update() {
    for (const chart of this.charts) chart.update();
    const { stored: every } = this.charts[0].view;
    document.getElementById("resolution").textContent = (this.clipped
      ? "Some values of the residual are outside its axis; zoom in to see them. " : "") + (every === 1
      ? "Here the page contains every sample."
      : `Here the page contains the smallest and the largest value of each ${every} samples, and every sample around the `
        + "largest error.");
  }

  // The pointer is in one picture: marks the same time in all others and reads the values.
  point(source) {
    if (this.pointing || !this.charts.includes(source)) return;
    this.pointing = true;
    const { left } = source.plot.cursor;
    const time = left === undefined || left === null || left < 0 ? null : source.plot.posToVal(left, "x");
    for (const chart of this.charts) if (chart !== source) chart.point(time);
    this.read(time);
    this.pointing = false;
  }

  read(time) {
    const readout = document.getElementById("readout");
    if (time === null) {
      readout.replaceChildren("Point at a picture to read values.");
      return;
    }
    const { experiment, output } = this;
    const sample = Math.min(Math.max(Math.round(time * experiment.rate), 0), experiment.samples - 1);
    const { unit } = stored.outputs[output], rows = [["time", `${number(sample / experiment.rate)} s`]];
    const add = (label, name, own) => {
      const [low, high] = experiment.at(name, sample);
      rows.push([label, (low === high ? number(low) : `${number(low)} to ${number(high)}`) + (own ? " " + own : "")]);
    };
    add("measured", "measured" + output, unit);
    add("before", "before" + output, unit);
    add("after", "after" + output, unit);
    add("residual before", "errorBefore" + output, unit);
    add("residual after", "errorAfter" + output, unit);
    for (const own of this.channels) add(own.name, own.signal, own.unit);
    readout.replaceChildren(...rows.flatMap(([label, value]) => {
      const strong = document.createElement("b");
      strong.textContent = value;
      return [`${label} `, strong, "  "];
    }));
  }

  resize() {
    for (const chart of this.charts) chart.resize();
    this.update();
  }

  remove() { for (const chart of this.charts) chart.remove(); }
}

const labelled = (name, unit) => (unit ? `${name} [${unit}]` : name);
// Six digits, without zeros at the end.
const number = (value) => String(Number(value.toPrecision(6)));
