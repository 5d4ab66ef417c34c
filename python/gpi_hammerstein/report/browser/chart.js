// Pictures over time. All of them show the same part of the experiment, except the picture of the largest error.

// The colours of the page, which may be light or dark.
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();
const printing = () => document.documentElement.classList.contains("printing");

// Widths of the pictures on paper, in pixels of 1/96 inch: those of the screen do not fit.
const ON_PAPER = { "chart-output": 410, "chart-detail": 270, "chart-residual": 690, "chart-inputs": 690 };
const ON_PAPER_HALF = 335;

function widthOf(host) {
  return printing() ? (ON_PAPER[host.id] ?? ON_PAPER_HALF) : Math.max(240, Math.floor(host.clientWidth));
}

function axis(label, extra) {
  return { label, labelSize: 20, labelFont: "12px system-ui, sans-serif", font: "12px system-ui, sans-serif", labelGap: 0,
    stroke: colour("ink"), grid: { stroke: colour("line"), width: 1 }, ticks: { stroke: colour("line"), width: 1 },
    ...extra };
}

// Room for the numbers of a vertical axis.
function room(chart, values) {
  const longest = Math.max(0, ...(values ?? []).map((text) => (text ?? "").length));
  return 16 + 7 * longest;
}

// A pattern of slanted lines, for samples that are not scored.
function hatched(context) {
  const tile = document.createElement("canvas");
  tile.width = tile.height = 10;
  const pen = tile.getContext("2d");
  pen.strokeStyle = colour("faint");
  pen.globalAlpha = 0.4;
  pen.beginPath();
  pen.moveTo(-1, 11);
  pen.lineTo(11, -1);
  pen.stroke();
  return context.createPattern(tile, "repeat");
}

class TimeChart {
  // `lines`: { name, label, colour, width, dash }; `band`: { name, half, colour }, the half-width around a line;
  // `range`: the limits of the vertical axis from the smallest and largest values that are visible.
  constructor(host, group, { title, label, lines, band = null, height, detail = null, range = null }) {
    Object.assign(this, { host, group, lines, band, detail, range });
    const series = [{}, ...lines.map((one) => ({ label: one.label, stroke: one.colour, width: one.width, dash: one.dash,
      points: { size: 4 } }))];
    const bands = [];
    if (band) {
      series.push({ label: "upper", points: { show: false } }, { label: "lower", points: { show: false } });
      bands.push({ series: [series.length - 2, series.length - 1], fill: band.colour });
    }
    this.plot = new uPlot({
      title, width: widthOf(host), height, series, bands,
      legend: { show: false },
      cursor: { y: false, drag: { x: true, y: false, setScale: false },
        bind: { dblclick: () => () => { group.whole(); return null; } } },
      scales: { x: { time: false, range: () => this.shown() },
        y: { auto: false, range: (plot, low, high) => [low, high] } },
      axes: [axis("time [s]", { size: 34 }), axis(label, { size: room })],
      hooks: {
        drawClear: [() => this.shade()],
        setCursor: [() => group.point(this)],
        setSelect: [() => this.selected()],
      },
    }, [[], ...series.slice(1).map(() => [])], host);
  }

  // The part of the experiment in this picture, in seconds.
  shown() { return this.detail ?? this.group.range; }

  // The limits of the vertical axis: all visible values of the lines that are shown, and a margin.
  vertical(view, [from, to]) {
    let low = Infinity, high = -Infinity;
    for (const one of this.lines) {
      if (this.group.hidden.has(one.kind)) continue;
      const own = view.signals[one.name];
      for (let i = 0; i < view.time.length; i++) {
        if (view.time[i] < from || view.time[i] > to) continue;
        if (own.low[i] < low) low = own.low[i];
        if (own.high[i] > high) high = own.high[i];
      }
    }
    if (low > high) return { min: -1, max: 1 };
    if (this.range) [low, high] = this.range(low, high);
    const margin = high > low ? 0.06 * (high - low) : Math.abs(high) || 1;
    return { min: low - margin, max: high + margin };
  }

  // Computes what is visible again, and draws it.
  update() {
    const [from, to] = this.shown();
    const names = this.lines.map((one) => one.name);
    const view = this.group.experiment.view(names, from, to, this.plot.bbox.width / devicePixelRatio || 600);
    this.view = view;
    const data = [view.time, ...names.map((name) => view.signals[name].line)];
    if (this.band) {
      const { low, high } = view.signals[this.band.name], { half } = this.band;
      data.push(high.map((value) => value + half), low.map((value) => value - half));
    }
    this.plot.batch(() => {
      this.lines.forEach((one, i) => this.plot.setSeries(i + 1, { show: !this.group.hidden.has(one.kind) }, false));
      if (this.band) for (const i of [1, 2])
        this.plot.setSeries(this.lines.length + i, { show: !this.group.hidden.has("band") }, false);
      this.plot.setData(data, false);
      this.plot.setScale("x", { min: from, max: to });
      this.plot.setScale("y", this.vertical(view, [from, to]));
    });
  }

  selected() {
    const { left, width } = this.plot.select;
    if (width < 3) return;
    const ends = [left, left + width].map((at) => this.plot.posToVal(at, "x"));
    this.plot.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.group.zoom(...ends);
  }

  // Held-out samples, samples that are not scored, and the range of the picture of the largest error.
  shade() {
    const { ctx, bbox } = this.plot, { experiment } = this.group, [from, to] = this.shown();
    const across = (first, last) => {
      const ends = [Math.max(first, from), Math.min(last, to)];
      if (ends[1] <= ends[0]) return null;
      const [left, right] = ends.map((time) => this.plot.valToPos(time, "x", true));
      return [left, bbox.top, Math.max(right - left, 1), bbox.height];
    };
    ctx.save();
    ctx.fillStyle = colour("held-out");
    for (const [first, last] of experiment.held_out) {
      const box = across(first / experiment.rate, (last - 1) / experiment.rate);
      if (box) ctx.fillRect(...box);
    }
    const start = experiment.warmup && across(0, experiment.warmup / experiment.rate);
    if (start) {
      ctx.fillStyle = hatched(ctx);
      ctx.fillRect(...start);
    }
    const marked = !this.detail && across(...this.group.largest());
    if (marked) {
      ctx.strokeStyle = colour("ink");
      ctx.setLineDash([4, 3]);
      ctx.strokeRect(...marked);
    }
    ctx.restore();
  }

  // Shows the time to which another picture points.
  point(time) {
    const [from, to] = this.shown(), inside = time !== null && time >= from && time <= to;
    this.plot.setCursor({ left: inside ? this.plot.valToPos(time, "x") : -10, top: inside ? 5 : -10 }, false);
  }

  resize() { this.plot.setSize({ width: widthOf(this.host), height: this.plot.height }); }

  remove() { this.plot.destroy(); }
}
