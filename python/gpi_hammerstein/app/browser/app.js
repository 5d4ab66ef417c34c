"use strict";
// The page of `gpi app`: files, choices, the search, and what is done with its result.

const element = (id) => document.getElementById(id);

// The state of the server, and what is chosen.
let settings = null;
let files = [];
let roles = null; // by the header of the column; null as long as the user has changed none
let inspected = 0;
let source = null;

/* requests */

async function ask(path, body) {
  const json = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(body) };
  return answerOf(body === undefined ? fetch(path) : fetch(path, json));
}

async function answerOf(request) {
  let answer;
  try {
    answer = await request;
  } catch {
    throw new Error("gpi app does not answer. If it has ended, start it again in the terminal.");
  }
  if (!answer.headers.get("Content-Type").startsWith("application/json")) throw new Error(await answer.text());
  const content = await answer.json();
  if (!answer.ok) throw new Error(content.message);
  return content;
}

async function upload(file) {
  if (file.size > settings.largest_upload)
    throw new Error(`${file.name}: has ${file.size} bytes, more than ${settings.largest_upload}; start gpi app with a larger value of `
      + "the environment variable GPI_MAX_UPLOAD_BYTES, or use the command line");
  return answerOf(fetch("files?name=" + encodeURIComponent(file.name), { method: "POST", body: file }));
}

/* what is shown */

function show(view) {
  for (const name of ["record", "search", "result"]) element("view-" + name).hidden = name !== view;
  for (const button of document.querySelectorAll("[data-view]")) {
    if (button.dataset.view === view) button.setAttribute("aria-current", "step");
    else button.removeAttribute("aria-current");
  }
}

function permit(view) { document.querySelector(`[data-view="${view}"]`).disabled = false; }

// Runs work whose errors are shown in one place of the page.
async function attempt(place, work, busy = null, words = "") {
  const line = element("error-" + place);
  line.hidden = true;
  if (busy) element(busy).textContent = words;
  try {
    return await work();
  } catch (error) {
    line.textContent = error.message;
    line.hidden = false;
    line.scrollIntoView({ block: "nearest" });
    return undefined;
  } finally {
    if (busy) element(busy).textContent = "";
  }
}

function paragraphs(host, sentences) {
  host.replaceChildren(...sentences.map((text) => Object.assign(document.createElement("p"), { textContent: text })));
}

function row(cells) {
  const line = document.createElement("tr");
  for (const cell of cells) {
    const own = document.createElement("td");
    own.append(cell);
    line.append(own);
  }
  return line;
}

/* the record */

function droppable(host, input, take) {
  host.addEventListener("dragover", (event) => { event.preventDefault(); host.classList.add("over"); });
  host.addEventListener("dragleave", () => host.classList.remove("over"));
  host.addEventListener("drop", (event) => {
    event.preventDefault();
    host.classList.remove("over");
    if (event.dataTransfer.files.length) take([...event.dataTransfer.files]);
  });
  input.addEventListener("change", () => {
    const dropped = [...input.files];
    input.value = ""; // so that the same file can be chosen again
    if (dropped.length) take(dropped);
  });
}
// A file that misses its place must not replace the page.
for (const name of ["dragover", "drop"]) addEventListener(name, (event) => event.preventDefault());

function chosen() {
  const found = { files, rate: element("rate").value, resample: element("resample").value,
    experiments: element("experiments").value };
  if (roles) {
    const named = (role) => [...roles].filter(([, own]) => own === role).map(([header]) => header);
    Object.assign(found, { input: named("input"), output: named("output"), covariate: named("covariate"),
      time: named("time")[0] ?? null });
  }
  return found;
}

async function takeRecord(dropped) {
  await attempt("record", async () => {
    const own = [];
    for (const file of dropped) own.push((await upload(file)).key);
    files = own;
    roles = null;
    for (const id of ["rate", "resample", "experiments"]) element(id).value = "";
    element("found").hidden = true;
    await inspect();
    element("found-title").focus();
  }, "busy-record", `Reading ${dropped.map((file) => file.name).join(", ")} …`);
}

async function inspect() {
  const mine = ++inspected, place = element("found");
  place.setAttribute("aria-busy", "true");
  element("start").disabled = true;
  try {
    const found = await ask("inspect", chosen());
    if (mine === inspected) await describe(found);
  } finally {
    if (mine === inspected) place.setAttribute("aria-busy", "false");
  }
}

const again = () => attempt("choice", inspect, "busy-choice", "Reading …");

async function describe(found) {
  element("found").hidden = false; // first, because what is hidden has no width
  const { record, problem, assumed } = found, usable = record !== null && !problem;
  element("size").textContent = `${found.files.join(", ")}: ` + (record
    ? `${record.samples} samples at ${number(record.rate_hz)} Hz, ${number(record.duration_s)} s`
      + (record.experiments > 1 ? ` in ${record.experiments} experiments` : "") : "cannot be read as a record yet.");
  element("problem").hidden = !problem;
  element("problem-words").textContent = problem ?? "";
  element("resample-now").hidden = !(assumed ?? "").startsWith("--resample");
  element("findings").replaceChildren(...[...found.notes, ...found.findings].map((text) =>
    Object.assign(document.createElement("li"), { textContent: text })));
  // the table is made anew, and the column that is being changed keeps the focus
  const { header } = document.activeElement.dataset;
  element("columns").tBodies[0].replaceChildren(...found.columns.map(columnRow));
  if (header) [...document.querySelectorAll("#columns select")].find((one) => one.dataset.header === header)?.focus();
  element("identifiable").tBodies[0].replaceChildren(...found.identifiable.map((one) => {
    const line = row([one.what, one.possible, one.why]);
    line.cells[1].className = "possible-" + one.possible;
    return line;
  }));
  element("row-experiments").hidden = element("experiments-hint").hidden = !(record?.experiments > 1);
  element("text").textContent = found.text;
  element("start").disabled = !usable;
  const host = element("plots-record");
  host.hidden = !found.drawn;
  if (found.drawn) await new Plots(host, "record").load();
}

function columnRow(column) {
  const select = document.createElement("select");
  select.setAttribute("aria-label", `Role of ${column.header}`);
  for (const role of ["time", "input", "output", "covariate", "unused"]) select.add(new Option(role));
  select.value = roles?.get(column.header) ?? column.role;
  select.addEventListener("change", () => {
    roles = new Map([...document.querySelectorAll("#columns select")].map((one) => [one.dataset.header, one.value]));
    again();
  });
  select.dataset.header = column.header;
  let values = column.text ?? (column.low === null ? "no numbers" : column.constant ? `constant, ${number(column.low)}`
    : `${number(column.low)} to ${number(column.high)}`);
  if (column.missing && column.low !== null) values += `, ${column.missing} missing`;
  if (column.step) values += `, steps of ${number(column.step)}`;
  return row([column.header, column.unit || "-", select, values, column.why]);
}

function effects() {
  const { value } = document.querySelector("input[name=effects]:checked");
  if (value === "all") return null;
  return value === "none" ? [] : [...document.querySelectorAll("#some-effects input:checked")].map((one) => one.value);
}

/* the search */

async function start() {
  await attempt("start", async () => {
    follow(await ask("search", { ...chosen(), effects: effects() }));
    element("search-title").focus();
  });
}

function clock(seconds) {
  if (seconds === null || seconds === undefined) return "";
  const whole = Math.round(seconds), hours = Math.floor(whole / 3600), minutes = Math.floor(whole / 60) % 60;
  const two = (value) => String(value).padStart(2, "0");
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

function follow(status) {
  permit("search");
  show("search");
  tell(status);
  source?.close();
  source = new EventSource("progress");
  source.addEventListener("message", (event) => tell(JSON.parse(event.data)));
  source.addEventListener("error", () => {
    if (source.readyState === EventSource.CLOSED) element("search-words").textContent = "gpi app does not answer any more.";
  });
}

function tell(status) {
  const now = status.progress, running = ["running", "stopping"].includes(status.state);
  element("bar").value = now?.done ?? 0;
  element("now-done").textContent = `${Math.round(100 * (now?.done ?? 0))} %`;
  element("now-stage").textContent = status.writing ? "drawing the report" : now?.stage ?? "starting";
  element("now-trial").textContent = now?.trial || "-";
  element("now-error").textContent = now?.error === null || !now ? "-" : number(now.error);
  element("now-elapsed").textContent = clock(now?.elapsed ?? 0);
  element("now-left").textContent = now?.remaining === null || !now ? "not known yet" : clock(now.remaining);
  element("cancel").hidden = !running;
  element("cancel").textContent = status.state === "stopping" ? "End at once, and keep nothing"
    : status.keeps ? "Stop, and keep what was found" : "Stop";
  element("cancel-hint").textContent = status.state === "running" && !status.keeps
    ? "If you stop now, no model is kept: the declared model is not fitted yet." : "";
  element("search-words").textContent = {
    running: "", stopping: "Stopping: the last fit is completed.", done: "The search is complete.",
    stopped: "The search was stopped.", failed: "The search failed.",
  }[status.state];
  if (running) return;
  source?.close();
  if (status.state === "done") {
    showResult(status.result);
    return;
  }
  // there is no result: back to the choice, with the reason
  show("record");
  attempt("start", () => { throw new Error(status.message); });
}

/* the result */

function showResult(result) {
  permit("result");
  show("result");
  const verdict = element("verdict");
  verdict.className = `verdict ${result.verdict}`;
  verdict.textContent = result.verdict;
  paragraphs(element("sentences"), result.sentences);
  element("report").src = "results/report.html?" + Date.now();
  for (const one of document.querySelectorAll(".drive-unit"))
    one.textContent = result.inputs.length === 1 && result.inputs[0].unit ? ` [${result.inputs[0].unit}]` : "";
  element("driven").hidden = true;
  element("exported").replaceChildren();
  element("result-title").focus();
}

let otherFile = null;
const split = (id) => {
  const names = element(id).value.split(",").map((name) => name.trim()).filter(Boolean);
  return names.length ? names : null;
};

async function takeOther(dropped) {
  await attempt("other", async () => {
    otherFile = await upload(dropped[0]);
    await driveOther();
  }, "busy-other", `Simulating ${dropped[0].name} …`);
}

async function driveOther() {
  if (!otherFile) throw new Error("Choose a file first.");
  element("driven").hidden = true;
  const found = await ask("drive", { files: [otherFile.key], input: split("other-input"), output: split("other-output"),
    rate: element("other-rate").value, resample: element("other-resample").value });
  element("driven").hidden = false;
  element("driven-title").textContent = `${otherFile.name}: ${found.samples} samples`;
  const { error } = found, rows = [];
  if (error) {
    rows.push(["rms error", `${number(error.rms)} ${found.unit}`], ["rms error / span", `${number(100 * error.nrmse)} %`],
      ["largest error", `${number(error.max)} ${found.unit}`]);
    for (const [name, fit] of Object.entries(found.fit_percent)) rows.push([`fit of ${name}`, `${number(fit)} %`]);
  }
  element("errors").tBodies[0].replaceChildren(...rows.map(row));
  const words = error ? [`Simulation error: ${found.rule}.`] : ["The record has no output column, so that no error can be computed."];
  paragraphs(element("driven-words"), [...words, ...found.sentences, ...found.notes]);
  await new Plots(element("plots-other"), "other").load();
  element("driven-title").focus();
}

async function makeC(event) {
  event.preventDefault();
  element("exported").replaceChildren();
  await attempt("export", async () => {
    const found = await ask("export", { low: element("low").value, high: element("high").value,
      precision: element("precision").value });
    paragraphs(element("exported"), [`Compensated: ${found.compensated.join(", ")}.`,
      ...found.left.map((text) => `Not compensated: ${text}.`)]);
    const links = document.createElement("p");
    links.className = "buttons";
    for (const name of found.files)
      links.append(Object.assign(document.createElement("a"), { className: "button", href: `results/${name}?download`,
        download: name, textContent: `Save ${name}` }));
    element("exported").append(links);
  });
}

/* the start */

async function begin() {
  settings = await ask("state");
  element("some-effects").append(...Object.entries(settings.effects).map(([name, what]) => {
    const label = document.createElement("label"), words = document.createElement("span");
    words.append(name, " ", Object.assign(document.createElement("small"), { textContent: what }));
    label.append(Object.assign(document.createElement("input"), { type: "checkbox", value: name }), words);
    return label;
  }));
  for (const button of document.querySelectorAll("[data-view]")) {
    button.disabled = button.dataset.view !== "record";
    button.addEventListener("click", () => show(button.dataset.view));
  }
  droppable(element("drop"), element("file"), takeRecord);
  droppable(element("drop-other"), element("other"), takeOther);
  for (const id of ["rate", "resample", "experiments"]) element(id).addEventListener("change", again);
  element("resample-now").addEventListener("click", () => { element("resample").value = "auto"; again(); });
  for (const one of document.querySelectorAll("input[name=effects]"))
    one.addEventListener("change", () => { element("some-effects").hidden = one.value !== "some"; });
  element("start").addEventListener("click", start);
  element("cancel").addEventListener("click", () => attempt("search", async () => tell(await ask("cancel", {}))));
  element("again").addEventListener("click", () => attempt("other", driveOther, "busy-other", "Simulating …"));
  element("export").addEventListener("submit", makeC);
  show("record");
  // after the page was loaded again, a search goes on
  if (settings.search) follow(settings.search);
}

begin().catch((error) => {
  show("record");
  attempt("record", () => { throw error; });
});
