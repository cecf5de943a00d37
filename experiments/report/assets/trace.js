// Curves: bytes to numbers, and numbers to as many as a plot can show.

async function inflate(bytes) {
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

function bytesOfBase64(text) {
  const binary = atob(text);
  const bytes = new Uint8Array(binary.length);
  for (let i = 0; i < binary.length; ++i) bytes[i] = binary.charCodeAt(i);
  return bytes;
}

const NO_NUMBER = 2 ** 46;

// One column of experiments/campaign/trace.hpp: LEB128, zigzag, first or second differences. Numbers beyond 2^31 need doubles.
function decodeColumn(bytes, at, count, column) {
  const values = new Float64Array(count);
  let last = 0, slope = 0;
  for (let i = 0; i < count; ++i) {
    let coded = 0, scale = 1, byte;
    do {
      byte = bytes[at++];
      coded += (byte & 127) * scale;
      scale *= 128;
    } while (byte > 127);
    const difference = coded % 2 ? -(coded + 1) / 2 : coded / 2;
    slope = column.order === 1 ? difference : slope + difference;
    last += slope;
    values[i] = last === NO_NUMBER ? NaN : last * column.resolution;
  }
  return values;
}

// {time [s], each signal by its name: arrays, in the unit people read it in; header: {tick_s, modes, panels, measured, shown}}.
async function decodeTrace(bytes) {
  if (String.fromCharCode(...bytes.subarray(0, 4)) !== "SLT2") throw new Error("not a trace");
  const all = await inflate(bytes.subarray(4));
  const length = new DataView(all.buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(all.subarray(4, 4 + length)));
  const columns = {};
  let at = 4 + length;
  for (const column of header.columns) {
    columns[column.name] = decodeColumn(all, at, header.samples, column);
    at += column.bytes;
  }
  return inUnits(columns, header);
}

// How people read a signal: as the first panel that shows it has it; `step` is its resolution in that unit.
function shownSignals(header) {
  const resolution = new Map([...(header.signals ?? header.columns), ...header.derived].map(({ name, resolution }) => [name, resolution]));
  const shown = {};
  for (const { unit, scale, modes, curves } of header.panels)
    for (const { signal } of curves) shown[signal] ??= { unit, scale, modes, step: scale * resolution.get(signal) };
  return shown;
}

// What `header` (trace_header() of trace.hpp) says of the columns, done: derived signals, people's units.
function inUnits(columns, header) {
  for (const { name, constant, terms } of header.derived)
    columns[name] ??= columns.tick.map((tick, i) => terms.reduce((sum, [signal, factor]) => sum + factor * columns[signal][i], constant));
  const { tick_s, modes, panels, measured } = header, shown = shownSignals(header);
  const trace = { header: { tick_s, modes, panels, measured, shown } };
  for (const [name, values] of Object.entries(columns)) trace[name] = shown[name] ? values.map((value) => shown[name].scale * value) : values;
  trace.time = columns.tick.map((tick) => tick * tick_s);
  return trace;
}

// Index of the first time >= limit.
function lowerBound(times, limit) {
  let low = 0, high = times.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < limit) low = middle + 1;
    else high = middle;
  }
  return low;
}

// What a plot of `spans` pixels shows of [from, to]: every sample where there are few, else of each span of time the lowest and
// highest value in their order, so that no peak is lost. Returns {time, NAME...}.
function windowOf(trace, names, from, to, spans) {
  const times = trace.time;
  const first = Math.max(0, lowerBound(times, from) - 1), last = Math.min(times.length, lowerBound(times, to) + 1);
  const result = {};
  if (last - first <= 2 * spans) {
    result.time = Array.from(times.subarray(first, last));
    for (const name of names) result[name] = Array.from(trace[name].subarray(first, last), finiteOrGap);
    return result;
  }
  const edges = [];
  for (let s = 0; s <= spans; ++s) edges.push(s === spans ? last : Math.max(first, lowerBound(times, from + ((to - from) * s) / spans)));
  edges[0] = first;
  result.time = [];
  for (let half = 0; half < 2 * spans; ++half) result.time.push(from + ((to - from) * (half + 0.5)) / (2 * spans));
  for (const name of names) result[name] = extremes(trace[name], edges);
  return result;
}

const finiteOrGap = (value) => (Number.isFinite(value) ? value : null);

function extremes(values, edges) {
  const reduced = [];
  for (let s = 0; s + 1 < edges.length; ++s) {
    let low = -1, high = -1;
    for (let i = edges[s]; i < edges[s + 1]; ++i) {
      if (!Number.isFinite(values[i])) continue;
      if (low < 0 || values[i] < values[low]) low = i;
      if (high < 0 || values[i] > values[high]) high = i;
    }
    if (low < 0) reduced.push(null, null);
    else reduced.push(values[Math.min(low, high)], values[Math.max(low, high)]);
  }
  return reduced;
}

// Where curves come from: elements of this page, or the program that serves it.
const traceSource = {
  cache: new Map(),
  async get(run, index, detail) {
    const key = `${detail} ${run.id}`;
    if (!this.cache.has(key)) {
      if (this.cache.size > 24) this.cache.delete(this.cache.keys().next().value);
      this.cache.set(key, this.load(run, index, detail).catch((problem) => { this.cache.delete(key); throw problem; }));
    }
    return this.cache.get(key);
  },
  async load(run, index, detail) {
    if (run.trace === "served") {
      const answer = await fetch(`trace/${encodeURIComponent(run.id)}`);
      if (!answer.ok) throw new Error(`the program answered ${answer.status}`);
      return decodeTrace(new Uint8Array(await answer.arrayBuffer()));
    }
    // Curves are at the end of the file, which may still be loading; an element is whole when something follows it.
    while (!byId(`${detail}-${index}`)?.nextSibling && document.readyState === "loading") await new Promise((done) => setTimeout(done, 30));
    const text = byId(`${detail}-${index}`)?.textContent;
    return text ? decodeTrace(bytesOfBase64(text)) : null;
  },
};
