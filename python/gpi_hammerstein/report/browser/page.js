// What the reader chooses: the experiment, the output, the lines, and the part of the record.

const element = (id) => document.getElementById(id);
const experiments = stored.experiments.map((own) => new Experiment(own, stored.rate));
const hidden = new Set();
let group = null, curves = null;

function fill(select, names, row) {
  names.forEach((name, index) => select.add(new Option(name, index)));
  row.hidden = names.length < 2;
  select.addEventListener("change", build);
}

// Draws everything for the choice.
function build() {
  const [experiment, output] = ["experiment", "output"].map((id) => Number(element(id).value));
  const range = group?.experiment === experiments[experiment] ? group.range : null;
  group?.remove();
  curves?.remove();
  group = new Group(experiments[experiment], output, hidden);
  if (range) group.zoom(...range);
  group.read(null);
  const rows = stored.curves[experiment];
  curves = rows ? new Curves(rows[output], output, Number(element("channel").value)) : null;
  element("no-curves").hidden = Boolean(rows);
  for (const figure of document.querySelectorAll("figure[data-experiment]"))
    figure.hidden = Number(figure.dataset.experiment) !== experiment;
}

function line(kind) {
  const button = document.createElement("button");
  button.type = "button";
  button.className = kind;
  button.textContent = kind;
  button.setAttribute("aria-pressed", "true");
  button.addEventListener("click", () => {
    if (!hidden.delete(kind)) hidden.add(kind);
    button.setAttribute("aria-pressed", String(!hidden.has(kind)));
    group.update();
  });
  element("lines").append(button);
}

const actions = {
  left: () => group.move(-0.5),
  right: () => group.move(0.5),
  in: () => group.scale(0.5),
  out: () => group.scale(2),
  whole: () => group.whole(),
  largest: () => group.zoom(...group.largest()),
};
const keys = { ArrowLeft: "left", ArrowRight: "right", "+": "in", "-": "out", 0: "whole" };

fill(element("experiment"), experiments.map((own, k) => `${k} (${number((own.samples) / stored.rate)} s)`),
  element("choose-experiment"));
fill(element("output"), stored.outputs.map((own) => own.name), element("choose-output"));
fill(element("channel"), stored.inputs.map((own) => own.name), element("choose-channel"));
["measured", "before", "after", "band"].forEach(line);
for (const [id, action] of Object.entries(actions)) element(id).addEventListener("click", action);
element("controls").addEventListener("submit", (event) => event.preventDefault());
for (const chart of document.querySelectorAll("#time .chart")) {
  chart.tabIndex = 0;
  chart.addEventListener("keydown", (event) => {
    if (!(event.key in keys)) return;
    event.preventDefault();
    actions[keys[event.key]]();
  });
}
element("controls").hidden = false;
build();

// The pictures are drawn again in other colours or sizes, also for paper.
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", build);
let width = innerWidth, waiting = 0;
addEventListener("resize", () => {
  if (innerWidth === width) return;
  width = innerWidth;
  cancelAnimationFrame(waiting);
  waiting = requestAnimationFrame(() => { group.resize(); curves?.resize(); });
});
// Paper shows everything, and is white.
let opened = [];
addEventListener("beforeprint", () => {
  opened = [...document.querySelectorAll("details:not([open])")];
  for (const details of opened) details.open = true;
  document.documentElement.classList.add("printing");
  build();
});
addEventListener("afterprint", () => {
  for (const details of opened) details.open = false;
  document.documentElement.classList.remove("printing");
  build();
});
