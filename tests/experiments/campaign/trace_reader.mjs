// The page's own reader of traces against numbers the program wrote, and its windows against a search by hand.
// Arguments: the page's trace.js, a trace, JSON {tick: [...], NAME: [...]} of the same in SI units.
import { readFileSync } from "node:fs";

const [script, bytes, numbers] = process.argv.slice(2);
const { decodeTrace, windowOf } = new Function(readFileSync(script, "utf8") + "; return { decodeTrace, windowOf };")();
const expected = JSON.parse(readFileSync(numbers, "utf8"));
const trace = await decodeTrace(new Uint8Array(readFileSync(bytes)));
const near = (a, b, step) => (b === null ? Number.isNaN(a) : Math.abs(a - b) <= 0.501 * step);
function check(holds, what) {
  if (holds) return;
  console.log(`does not hold: ${what}`);
  process.exit(1);
}

check(trace.time.length === expected.tick.length, "as many samples");
expected.tick.forEach((tick, i) => check(Math.abs(trace.time[i] - tick / 1000) < 1e-9, `time of sample ${i}`));
const kinds = { reference: [1e3, 1e-4], position: [1e3, 1e-4], pressure_a: [1e-3, 1e-2], pressure_b: [1e-3, 1e-2], mode: [1, 1], motor: [1, 1e-3] };
for (const [name, [factor, step]] of Object.entries(kinds))
  expected[name].forEach((value, i) => check(near(trace[name][i], value === null ? null : factor * value, step), `${name} of sample ${i}`));
expected.reference.forEach((value, i) => check(Math.abs(trace.error[i] - (trace.reference[i] - trace.position[i])) < 1e-9 || Number.isNaN(trace.error[i]), `error of sample ${i}`));

const all = trace.time.at(-1);
for (const [from, to, spans] of [[0, all, 50], [0.3 * all, 0.7 * all, 33], [0.5, 0.6, 400], [-1, 2 * all, 20]]) {
  const part = windowOf(trace, ["position"], from, to, spans);
  check(part.time.every((t, i) => i === 0 || part.time[i - 1] < t), "times increase");
  const inside = [...trace.position].filter((value, i) => trace.time[i] >= from && trace.time[i] <= to && Number.isFinite(value));
  const shown = part.position.filter((value) => value !== null);
  check(Math.min(...shown) <= Math.min(...inside) && Math.max(...shown) >= Math.max(...inside), `no peak lost in ${from} to ${to}`);
  if (part.time.length === 2 * spans)
    for (let s = 1; s + 1 < spans; ++s) {  // the first and the last span also hold the sample beyond the window
      const low = from + ((to - from) * s) / spans, high = from + ((to - from) * (s + 1)) / spans;
      const own = [...trace.position].filter((value, i) => trace.time[i] >= low && trace.time[i] < high && Number.isFinite(value));
      const pair = part.position.slice(2 * s, 2 * s + 2);
      if (!own.length) check(pair[0] === null && pair[1] === null, `a gap in span ${s}`);
      else check(Math.min(...pair) === Math.min(...own) && Math.max(...pair) === Math.max(...own), `extremes of span ${s}`);
    }
  else check(part.time.length >= inside.length, "every sample where there are few");
}
console.log("same");
