// The samples of the page: unpacked from text when they are needed, and reduced to what a picture can show.
//
// Each experiment has parts. The first one covers the whole experiment. Where it contains groups of samples
// (`every` > 1) in place of samples, further parts contain all samples of windows.

const stored = JSON.parse(document.getElementById("samples").textContent);

// Numbers from base64 text: x = offset + step q.
function unpack({ kind, offset, step, data }) {
  const text = atob(data), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const small = kind === "i2" ? new Int16Array(bytes.buffer) : new Float32Array(bytes.buffer);
  const values = new Float64Array(small.length);
  for (let i = 0; i < small.length; i++) values[i] = offset + step * small[i];
  return values;
}

class Part {
  constructor(own) {
    this.first = own.first;
    this.last = own.last;
    this.every = own.every;
    this.packed = own.signals;
    this.ready = new Map();
  }

  // The smallest and the largest values of each group; the same array twice if each group is one sample.
  signal(name) {
    if (!this.ready.has(name)) this.ready.set(name, this.unpacked(name));
    return this.ready.get(name);
  }

  unpacked(name) {
    if (this.every > 1) {
      const [low, high] = this.packed[name].map(unpack);
      return { low, high };
    }
    // a simulated output is the measured one minus the error
    const [, simulated, output] = name.match(/^(before|after)(\d+)$/) ?? [];
    let values;
    if (simulated) {
      const measured = this.signal("measured" + output).low;
      const error = this.signal((simulated === "before" ? "errorBefore" : "errorAfter") + output).low;
      values = measured.map((value, i) => value - error[i]);
    } else {
      values = unpack(this.packed[name]);
    }
    return { low: values, high: values };
  }
}

class Experiment {
  constructor(own, rate) {
    Object.assign(this, own);
    this.rate = rate;
    this.parts = own.parts.map((part) => new Part(part));
  }

  // The part with the most detail that covers the samples from `first` to `last`.
  part(first, last) {
    return this.parts.find((one) => one.every === 1 && one.first <= first && last <= one.last) ?? this.parts[0];
  }

  // What a picture of `columns` columns shows between two times: the times, and for each signal the values of
  // the line, which goes through the smallest and the largest value of every column, and these two values.
  view(names, from, to, columns) {
    const first = Math.max(0, Math.floor(from * this.rate)), last = Math.min(this.samples, Math.ceil(to * this.rate) + 1);
    const part = this.part(first, last), { every } = part;
    const start = Math.max(0, Math.floor((first - part.first) / every) - 1);
    const end = Math.min(Math.ceil((part.last - part.first) / every), Math.ceil((last - part.first) / every) + 1);
    const each = end - start <= 2 * columns ? 1 : Math.ceil((end - start) / columns);
    const exact = every === 1 && each === 1;
    const groups = Math.max(0, Math.ceil((end - start) / each)), points = exact ? groups : 2 * groups;
    const time = new Float64Array(points);
    for (let i = 0; i < points; i++)
      time[i] = (part.first + every * (start + each * (exact ? i : i / 2))) / this.rate;
    const signals = {};
    for (const name of names) {
      const { low, high } = part.signal(name);
      if (exact) {
        const values = low.subarray(start, end);
        signals[name] = { line: values, low: values, high: values };
        continue;
      }
      const line = new Float64Array(points), lows = new Float64Array(points), highs = new Float64Array(points);
      for (let group = 0; group < groups; group++) {
        const begin = start + group * each, stop = Math.min(begin + each, end);
        let least = Infinity, most = -Infinity;
        for (let i = begin; i < stop; i++) {
          if (low[i] < least) least = low[i];
          if (high[i] > most) most = high[i];
        }
        const at = 2 * group;
        line[at] = lows[at] = lows[at + 1] = least;
        line[at + 1] = highs[at] = highs[at + 1] = most;
      }
      signals[name] = { line, low: lows, high: highs };
    }
    return { time, signals, exact, every: every * each, stored: every };
  }

  // The value of a signal at a sample: the smallest and the largest one of its group.
  at(name, sample) {
    const part = this.part(sample, sample + 1), { low, high } = part.signal(name);
    const group = Math.floor((sample - part.first) / part.every);
    return [low[group], high[group]];
  }
}
