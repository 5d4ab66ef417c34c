// The chosen device: marked in every distribution and every trend, and described at the bottom of the page.

// Places of the pictures, in their own units.
const AXIS = { left: 10, right: 310, bars: [4, 126], dates: [8, 124] };
const panel = document.getElementById("chosen");

function drawn(svg, name, attributes) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, own] of Object.entries(attributes)) made.setAttribute(key, own);
  svg.append(made);
}

function choose(device) {
  for (const mark of document.querySelectorAll("svg .mark")) mark.remove();
  table.mark(device);
  document.body.classList.toggle("has-chosen", device >= 0);
  panel.hidden = device < 0;
  if (device < 0) return;
  const { record } = stored.devices[device], across = (at) => AXIS.left + (AXIS.right - AXIS.left) * at;
  for (const host of document.querySelectorAll("figure[data-figure]")) {
    const figure = figures[host.dataset.figure], own = record < 0 ? NaN : figure.all[record];
    if (Number.isNaN(own)) continue;
    const x = across(part(figure, own)).toFixed(1);
    drawn(host.querySelector("svg"), "path", { class: "mark", d: `M${x} ${AXIS.bars[0]}V${AXIS.bars[1]}` });
  }
  const dated = datedRecords(device);
  for (const host of document.querySelectorAll("figure[data-dates]")) {
    const { first, last, low, high } = host.dataset, figure = figures[host.dataset.dates], svg = host.querySelector("svg");
    const [top, base] = AXIS.dates;
    const points = dated.filter((one) => !Number.isNaN(figure.all[one])).map((one) => [
      across((days[one] - first) / (last - first)),
      base - (base - top) * part({ low: Number(low), high: Number(high) }, figure.all[one])]);
    if (points.length > 1) drawn(svg, "path", { class: "mark", d: "M" + points.map((one) => one.join(" ")).join("L") });
    for (const [cx, cy] of points) drawn(svg, "circle", { class: "mark point", cx, cy, r: 4 });
  }
  describe(stored.devices[device]);
}

// What is known of a device, as text: names and reasons may contain any characters.
function describe(own) {
  const close = document.createElement("button"), title = document.createElement("h2");
  close.type = "button";
  close.className = "close";
  close.textContent = "Close";
  close.addEventListener("click", () => choose(-1));
  title.textContent = own.name;
  const facts = document.createElement("p");
  const known = [own.verdict, own.effects || "no effect", own.date, `${own.records} record${own.records > 1 ? "s" : ""}`,
    own.file];
  facts.textContent = known.filter(Boolean).join(" · ") + " ";
  if (own.link) facts.append(linkTo(own.link));
  const why = document.createElement("ul");
  why.append(...own.why.map((text) => {
    const item = document.createElement("li");
    item.textContent = text;
    return item;
  }));
  panel.replaceChildren(close, title, facts, ...(own.why.length ? [why] : []));
}

const table = new DeviceTable(choose);
for (const host of document.querySelectorAll("[data-device]"))
  host.addEventListener("click", () => choose(Number(host.dataset.device)));
addEventListener("keydown", (event) => { if (event.key === "Escape") choose(-1); });
