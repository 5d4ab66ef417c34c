// The table of all devices: sorted by any column, searched, and a part of the rows at a time.

const ROWS = 100;

class DeviceTable {
  // `choose` is called with the number of a device.
  constructor(choose) {
    this.choose = choose;
    const text = (key) => ({ title: key, of: (own) => own[key] });
    this.columns = [
      { title: "device", of: (own) => own.name },
      { title: "reasons", number: true, of: (own) => own.why.length },
      text("verdict"), text("effects"), { ...text("date"), kind: "date" },
      ...figures.filter((figure) => !figure.effect)
        .map((figure) => ({ title: withUnit(figure), number: true, of: (own) => value(figure, own.record) })),
    ];
    this.order = { column: 1, falling: true };
    this.rows = ROWS;
    this.here = -1;
    this.searched = stored.devices.map((own) =>
      [own.name, own.verdict, own.effects, own.file, own.date, ...own.why].join("\n").toLowerCase());
    this.host = document.getElementById("table");
    document.getElementById("search-form").addEventListener("submit", (event) => event.preventDefault());
    for (const id of ["search", "only-unusual"])
      document.getElementById(id).addEventListener("input", () => { this.rows = ROWS; this.draw(); });
    document.getElementById("more").addEventListener("click", () => { this.rows += ROWS; this.draw(); });
    document.getElementById("search-form").hidden = false;
    this.draw();
  }

  // The numbers of the devices that are searched for, in order. Unknown values are last.
  found() {
    const words = document.getElementById("search").value.toLowerCase().split(/\s+/).filter(Boolean);
    const only = document.getElementById("only-unusual").checked;
    const { column, falling } = this.order, { of, number } = this.columns[column], sign = falling ? -1 : 1;
    const keys = stored.devices.map(of);
    const unknown = (key) => (number ? Number.isNaN(key) : key === "");
    const compared = (a, b) => (number ? a - b : a < b ? -1 : a > b ? 1 : 0);
    return stored.devices.map((own, i) => i)
      .filter((i) => (!only || stored.devices[i].why.length) && words.every((word) => this.searched[i].includes(word)))
      .sort((a, b) => unknown(keys[a]) - unknown(keys[b]) || (unknown(keys[a]) ? 0 : sign * compared(keys[a], keys[b]))
        || a - b);
  }

  draw() {
    const found = this.found();
    const body = document.createElement("tbody");
    body.append(...found.slice(0, this.rows).map((device) => this.row(device)));
    const head = document.createElement("thead");
    head.append(this.head());
    this.host.replaceChildren(head, body);
    document.getElementById("matches").textContent = `${found.length} of ${stored.devices.length} devices`;
    document.getElementById("more").hidden = found.length <= this.rows;
  }

  head() {
    const row = document.createElement("tr");
    this.columns.forEach(({ title, number }, column) => {
      const cell = document.createElement("th"), button = document.createElement("button");
      button.type = "button";
      button.textContent = title;
      if (number) cell.className = "number";
      if (column === this.order.column) cell.setAttribute("aria-sort", this.order.falling ? "descending" : "ascending");
      button.addEventListener("click", () => {
        const again = column === this.order.column;
        this.order = { column, falling: again ? !this.order.falling : Boolean(number) };
        this.draw();
      });
      cell.append(button);
      row.append(cell);
    });
    const last = document.createElement("th");
    last.textContent = "result";
    row.append(last);
    return row;
  }

  row(device) {
    const own = stored.devices[device], row = document.createElement("tr");
    row.dataset.row = device;
    row.classList.toggle("here", device === this.here);
    this.columns.forEach(({ of, number, kind }, column) => {
      const cell = document.createElement("td"), known = of(own);
      cell.className = number ? "number" : (kind ?? "");
      if (column === 0) {
        const button = document.createElement("button");
        button.type = "button";
        button.className = "device";
        button.textContent = known;
        button.addEventListener("click", () => this.choose(device));
        cell.append(button);
      } else cell.textContent = number ? digits(known) : known;
      row.append(cell);
    });
    const cell = document.createElement("td");
    if (own.link) cell.append(linkTo(own.link));
    row.append(cell);
    return row;
  }

  mark(device) {
    this.here = device;
    for (const row of this.host.querySelectorAll("tr[data-row]"))
      row.classList.toggle("here", Number(row.dataset.row) === device);
  }
}

function linkTo(address) {
  const link = document.createElement("a");
  link.href = address;
  link.textContent = address.endsWith(".html") ? "report" : "explanation";
  return link;
}
