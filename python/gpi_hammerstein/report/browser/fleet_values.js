// The values of the page: of each figure for each record, on the scale on which devices are compared.

const records = unpack(stored.owners).length;
// rounded, because packed numbers are
const owners = unpack(stored.owners).map(Math.round);

// All values of a packed array, of which only the known ones are stored; NaN is unknown.
function whole({ places, values }) {
  const all = new Float64Array(records).fill(NaN), known = unpack(values);
  unpack(places).forEach((place, i) => { all[Math.round(place)] = known[i]; });
  return all;
}

const days = whole(stored.days);
const figures = stored.figures.map((own) => ({ ...own, all: whole(own) }));

// The records of a device that have a date, the earliest first.
const datedRecords = (device) => Array.from(owners.keys())
  .filter((record) => owners[record] === device && !Number.isNaN(days[record]))
  .sort((a, b) => days[a] - days[b]);

// The value of a figure in its unit.
function value(figure, record) {
  const own = record < 0 ? NaN : figure.all[record];
  return figure.logarithmic ? figure.sign * Math.exp(own) : own;
}

// Where a value is on the axis of a figure, from 0 to 1.
const part = ({ low, high }, own) => Math.min(Math.max((own - low) / (high - low), 0), 1);
const digits = (number) => (Number.isNaN(number) ? "" : String(Number(number.toPrecision(4))));
const withUnit = (figure) => (figure.unit ? `${figure.label} [${figure.unit}]` : figure.label);
