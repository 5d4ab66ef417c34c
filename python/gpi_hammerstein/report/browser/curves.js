// The residual over frequency, lag, input and speed.

class Curves {
  // `rows`: the curves of one experiment and output; `input`: the channel of the pictures over the input.
  constructor(rows, output, input) {
    this.plots = [];
    const { unit, noise } = stored.outputs[output], channel = stored.inputs[input];
    const errorLabel = labelled("residual", unit);
    const { spectrum, autocorrelation } = rows, over = rows.over[input];
    if (spectrum) {
      const lines = spectrum.densities.map((own) => unpack(own).map((power) => 10 ** power));
      const frequencies = Float64Array.from(lines[0], (_, i) => (i + 1) * spectrum.spacing);
      const floor = Float64Array.from(lines[0], () => noise / Math.sqrt(stored.rate / 2));
      this.add("chart-spectrum", "Over frequency", "frequency [Hz]", labelled("density", unit && `${unit}/√Hz`),
        [frequencies, ...lines, floor], [stroke("before"), stroke("after"), { stroke: colour("ink"), dash: [2, 3], width: 1 }],
        [], true);
    }
    if (autocorrelation) {
      const { values, bound } = autocorrelation, lags = values[0].map((_, i) => i + 1);
      this.add("chart-autocorrelation", "Over lag", "lag [samples]", "autocorrelation [-]",
        [lags, lags.map(() => bound), lags.map(() => -bound), ...values],
        [{}, {}, stroke("before"), stroke("after")], [{ series: [1, 2], fill: colour("held-out") }]);
    }
    this.classes("chart-input", `Over ${channel.name}`, labelled(channel.name, channel.unit), errorLabel, over.input);
    this.classes("chart-speed", `Over the speed of ${channel.name}`,
      labelled(`d${channel.name}/dt`, channel.unit ? channel.unit + "/s" : "1/s"), errorLabel, over.speed);
  }

  // Mean and two quantiles of both errors.
  classes(id, title, label, errorLabel, own) {
    if (!own) return;
    const [before, after] = own.errors, faint = (name) => ({ stroke: colour(name), width: 0.5 });
    this.add(id, title, label, errorLabel, [own.x, before[0], before[2], before[1], after[0], after[2], after[1]],
      [stroke("before"), faint("before"), faint("before"), stroke("after"), faint("after"), faint("after")],
      [{ series: [2, 3], fill: colour("held-out") }, { series: [5, 6], fill: colour("band") }]);
  }

  add(id, title, label, vertical, data, lines, bands, logarithmic = false) {
    const host = document.getElementById(id);
    // lines of the grid only at powers of ten
    const decades = logarithmic ? { grid: { stroke: colour("line"), width: 1, filter: onlyPowers } } : {};
    const scale = logarithmic ? { distr: 3 } : {};
    this.plots.push([host, new uPlot({
      title, width: widthOf(host), height: 260, bands,
      legend: { show: false },
      cursor: { y: false, drag: { x: true, y: false } },
      series: [{}, ...lines.map((line) => ({ points: { show: false }, ...line }))],
      scales: { x: { time: false, ...scale }, y: { ...scale } },
      axes: [axis(label, { size: 34, ...decades }), axis(vertical, { size: room, ...decades, ...(logarithmic && { values: powers }) })],
    }, data, host)]);
  }

  resize() { for (const [host, plot] of this.plots) plot.setSize({ width: widthOf(host), height: plot.height }); }

  remove() { for (const [, plot] of this.plots) plot.destroy(); }
}

const stroke = (name) => ({ stroke: colour(name), width: 1.3 });
const isPower = (value) => Math.abs(Math.log10(value) - Math.round(Math.log10(value))) < 1e-9;
const onlyPowers = (plot, splits) => splits.map((value) => (value > 0 && isPower(value) ? value : null));
// Numbers of a logarithmic axis, only at powers of ten.
const powers = (plot, splits) =>
  splits.map((value) => (value > 0 && isPower(value) ? `1e${Math.round(Math.log10(value))}` : ""));
