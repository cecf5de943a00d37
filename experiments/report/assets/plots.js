// The five plots over one time axis: position, error, valve mode, force or pressures, motor.

const PANELS = [
  { key: "position", label: "position [mm]", signals: ["position", "reference"], height: 112 },
  { key: "error", label: "error [mm]", signals: ["error"], height: 96 },
  { key: "mode", label: "valve mode", signals: ["mode"], height: 126 },
  { key: "fourth", label: "cylinder [N]", signals: ["cylinder"], height: 96 },
  { key: "motor", label: "motor [N]", signals: ["motor"], height: 90 },
];
const FOURTH = {
  cylinder: { label: "cylinder [N]", signals: ["cylinder"] },
  pressure: { label: "pressure [kPa]", signals: ["pressure_a", "pressure_b"] },
};
const LEFT = 70, RIGHT = 128, TIME_AXIS = 38;  // px beside and below the plots
const READOUT = [
  ["time", "s", 3], ["reference", "mm", 3], ["position", "mm", 3], ["error", "mm", 3], ["mode", "", 0],
  ["cylinder", "N", 2], ["pressure_a", "kPa", 1], ["pressure_b", "kPa", 1], ["motor", "N", 2],
];
const READOUT_NAMES = { pressure_a: "pressure A", pressure_b: "pressure B", mode: "valve mode" };

// A piece of line as it is drawn in the plots.
function lineDrawing(name, dash) {
  const drawing = svgElement("svg", { width: 26, height: 8, style: "display:inline;width:26px;vertical-align:middle", "aria-hidden": "true" });
  drawing.append(svgElement("line", { x1: 0, x2: 26, y1: 4, y2: 4, stroke: `var(--${name})`, "stroke-width": 2, "stroke-dasharray": dash }));
  return drawing;
}

class Curves {
  constructor(place) {
    this.place = place;
    this.slots = { a: null, b: null };  // {run, overview, full}
    this.view = null;                   // {from, to} in s; null: all
    this.plots = [];
    this.modes = [];
    new ResizeObserver(() => this.resize()).observe(place);
    place.addEventListener("keydown", (event) => this.key(event));
  }

  // Puts a run into slot a or b: its overview at once if it has one, every tick as soon as they are decoded.
  async show(slot, run, index) {
    const held = run ? { run, index, overview: null, full: null } : null;
    this.slots[slot] = held;
    if (held) {
      const reduced = run.trace === "both" || run.trace === "overview";
      held.overview = run.trace === "none" ? null : await traceSource.get(run, index, reduced ? "overview" : "full");
      held.full = reduced ? null : held.overview;
      if (this.slots[slot] !== held) return;
    }
    this.draw();
    if (held?.run.trace !== "both") return;
    held.full = await traceSource.get(run, index, "full");
    if (this.slots[slot] === held) this.refresh();
  }

  held() { return ["a", "b"].map((slot) => ({ slot, ...this.slots[slot] })).filter((held) => held.overview); }
  whole() {
    const held = this.held();
    return { from: Math.min(...held.map((h) => h.overview.time[0])), to: Math.max(...held.map((h) => h.overview.time.at(-1))) };
  }
  range() { return this.view ?? this.whole(); }
  // The whole run is drawn from its overview, a part of it from every tick.
  traceOf(held) { return this.view && held.full ? held.full : held.overview; }

  zoom(view) {
    const whole = this.whole();
    if (view) {
      const width = Math.max(0.01, view.to - view.from);
      const from = Math.min(Math.max(view.from, whole.from), Math.max(whole.from, whole.to - width));
      view = { from, to: Math.min(from + width, whole.to) };
      if (view.from <= whole.from && view.to >= whole.to) view = null;
    }
    if (JSON.stringify(view) === JSON.stringify(this.view)) return;
    this.view = view;
    this.refresh();
  }
  zoomBy(factor, around) {
    const { from, to } = this.range();
    const centre = around ?? (from + to) / 2;
    this.zoom({ from: centre - (centre - from) * factor, to: centre + (to - centre) * factor });
  }
  pan(share) {
    const { from, to } = this.range(), shift = share * (to - from);
    this.zoom({ from: from + shift, to: to + shift });
  }

  // Names of all modes shown: run A's, then what B has beyond them.
  collectModes() {
    this.modes = [];
    for (const { overview } of this.held())
      for (const name of overview.modes) if (!this.modes.includes(name)) this.modes.push(name);
  }
  labelOf(panel) { return panel.key === "fourth" ? FOURTH[byId("fourth").value].label : panel.label; }
  signalsOf(panel) { return panel.key === "fourth" ? FOURTH[byId("fourth").value].signals : panel.signals; }
  // Run B's reference is drawn where it is another than A's.
  shown(held, signal) {
    return signal !== "reference" || held.slot === "a" || !this.slots.a?.overview || this.slots.a.run.scenario !== held.run.scenario;
  }

  dataOf(panel) {
    const { from, to } = this.range();
    const tables = this.held().map((held) => {
      const trace = this.traceOf(held);
      const names = this.signalsOf(panel).filter((signal) => this.shown(held, signal));
      const part = windowOf(trace, names, from, to, Math.max(300, this.place.clientWidth - LEFT - RIGHT));
      if (panel.key === "mode") part.mode = part.mode.map((mode) => (trace.modes[mode] === undefined ? null : this.modes.indexOf(trace.modes[mode])));
      return [part.time, ...names.map((name) => part[name])];
    });
    return tables.length > 1 ? uPlot.join(tables) : tables[0];
  }

  seriesOf(panel) {
    const series = [{}];
    for (const held of this.held())
      for (const signal of this.signalsOf(panel).filter((name) => this.shown(held, name))) {
        const reference = signal === "reference", second = signal === "pressure_b";
        series.push({
          stroke: reference ? (held.slot === "a" ? colour("reference") : colour("b")) : colour(held.slot),
          width: reference ? 1 : panel.key === "mode" ? 0.9 : 1.4,
          dash: reference ? [7, 5] : second ? [3, 3] : undefined,
          paths: panel.key === "mode" ? uPlot.paths.stepped({ align: 1 }) : uPlot.paths.linear(),
          points: { show: false },
          spanGaps: this.held().length > 1,
        });
      }
    return series;
  }

  limits(panel, low, high) {
    if (panel.key === "mode") return [-0.5, this.modes.length - 0.5];
    if (panel.key === "motor") {
      const limit = 1.1 * Math.max(1, ...this.held().map((held) => held.overview.motorLimit));
      return [Math.min(-limit, low ?? 0), Math.max(limit, high ?? 0)];
    }
    if (low === null || low === undefined) return [-1, 1];
    const zero = panel.key === "error" || (panel.key === "fourth" && byId("fourth").value === "cylinder");
    if (zero) { low = Math.min(low, 0); high = Math.max(high, 0); }
    const margin = 0.06 * Math.max(high - low, 1e-3);
    return [low - margin, high + margin];
  }

  axesOf(panel, last) {
    const font = "12px system-ui, 'Liberation Sans', sans-serif", grid = { stroke: colour("grid"), width: 1 };
    const common = { stroke: colour("quiet"), font, labelFont: font, grid, ticks: { ...grid, size: 4 } };
    const time = last
      ? { ...common, label: "time [s]", labelSize: 16, size: TIME_AXIS - 16, gap: 2, values: (u, splits) => splits.map((value) => String(Number(value.toFixed(4))).replace("-", "\u2212")) }
      : { ...common, size: 0, values: () => [], ticks: { show: false } };
    const value = { ...common, label: this.labelOf(panel), labelSize: 18, size: LEFT - 18, gap: 3, space: 24, values: (u, splits) => splits.map((v) => String(Number(v.toPrecision(6))).replace("-", "\u2212")) };
    if (panel.key !== "mode") return [time, value];
    const splits = () => this.modes.map((name, i) => i);
    const small = `${this.modes.length > 4 ? 10 : 11}px system-ui, 'Liberation Sans', sans-serif`;
    return [time, { ...value, splits }, { ...common, side: 1, size: RIGHT, gap: 4, font: small, grid: { show: false }, splits, values: () => this.modes }];
  }

  optionsOf(panel, last) {
    const modeRoom = panel.key === "mode" ? 12 * Math.max(0, this.modes.length - 9) : 0;
    const height = panel.height + modeRoom + (last ? TIME_AXIS : 0);
    return {
      width: Math.max(320, this.place.clientWidth), height, legend: { show: false }, focus: { alpha: 1 },
      padding: [5, panel.key === "mode" ? 0 : RIGHT, last ? 0 : 4, 0],
      scales: { x: { time: false, range: () => { const { from, to } = this.range(); return [from, to]; } }, y: { range: (u, low, high) => this.limits(panel, low, high) } },
      axes: this.axesOf(panel, last),
      series: this.seriesOf(panel),
      cursor: {
        sync: { key: "time" }, y: false, drag: { x: true, y: false, setScale: false }, points: { size: 5 },
        bind: { dblclick: () => () => { this.zoom(null); return null; } },
      },
      hooks: { setSelect: [(u) => this.selected(u)], setCursor: [(u) => u === this.plots[0] && this.pointed(u)] },
    };
  }

  draw() {
    this.plots.forEach((plot) => plot.destroy());
    this.plots = [];
    this.place.replaceChildren();
    const held = this.held();
    const missing = ["a", "b"].map((slot) => this.slots[slot]).filter((h) => h && !h.overview && h.run.trace === "none");
    byId("no-curves").textContent = held.length || !missing.length ? "" : "This run has no curves: its folder holds neither a trace nor a log of it.";
    this.place.hidden = !held.length;
    if (!held.length) return;
    this.collectModes();
    byId("legend").replaceChildren(...this.legend());
    for (const panel of PANELS) {
      const box = element("div", { role: "img" });
      this.place.append(box);
      this.plots.push(new uPlot(this.optionsOf(panel, panel === PANELS.at(-1)), this.dataOf(panel), box));
    }
    this.describe();
    this.pointed(this.plots[0]);
  }
  refresh() {
    if (!this.plots.length) return;
    this.plots.forEach((plot, i) => plot.setData(this.dataOf(PANELS[i])));
    this.describe();
    this.pointed(this.plots[0]);
  }
  resize() {
    if (!this.plots.length || this.plots[0].width === Math.max(320, this.place.clientWidth)) return;
    this.plots.forEach((plot) => plot.setSize({ width: Math.max(320, this.place.clientWidth), height: plot.height }));
    this.refresh();
  }

  // What the lines are that do not stand for run A or B.
  legend() {
    const entries = [element("span", {}, lineDrawing("reference", "7 5"), " reference")];
    if (byId("fourth").value === "pressure")
      entries.push(element("span", {}, lineDrawing("quiet", "none"), " chamber A"), element("span", {}, lineDrawing("quiet", "3 3"), " chamber B"));
    if (this.held().some(({ overview }) => overview.measured)) entries.push(element("span", {}, "position and pressures as measured"));
    return entries;
  }

  // What the plots show, for who cannot see them, and for tests.
  describe() {
    const { from, to } = this.range();
    this.place.dataset.from = from;
    this.place.dataset.to = to;
    this.place.dataset.detail = this.view && this.held().every((held) => held.full) ? "full" : "overview";
    this.plots.forEach((plot, i) => {
      const parts = plot.data.slice(1).map((values) => values.filter((value) => value !== null && value !== undefined))
        .filter((values) => values.length).map((values) => values.reduce(([low, high], v) => [Math.min(low, v), Math.max(high, v)], [Infinity, -Infinity]));
      const spans = parts.map(([low, high]) => `${shortNumber(low)} to ${shortNumber(high)}`).join(" and ");
      plot.root.parentNode.setAttribute("aria-label", `${this.labelOf(PANELS[i])}, ${fixed(from, 2)} to ${fixed(to, 2)} s: ${spans}`);
    });
  }

  selected(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    const from = plot.posToVal(left, "x"), to = plot.posToVal(left + width, "x");
    for (const each of this.plots) each.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoom({ from, to });
  }

  valuesAt(time) {
    return this.held().map((held) => {
      const trace = held.full ?? held.overview;
      let i = Math.min(lowerBound(trace.time, time), trace.time.length - 1);
      if (i > 0 && time - trace.time[i - 1] < trace.time[i] - time) --i;
      return Object.fromEntries(READOUT.map(([key]) => [key, key === "mode" ? trace.modes[trace.mode[i]] ?? "-" : trace[key][i]]));
    });
  }
  pointed(plot) {
    const { left } = plot?.cursor ?? {};
    const over = left >= 0 && left !== null;
    const columns = over ? this.valuesAt(plot.posToVal(left, "x")) : this.held().map(() => null);
    const cell = (values, key, digits) => (!values ? "" : key === "mode" ? values.mode : fixed(values[key], digits));
    byId("readout").replaceChildren(
      element("caption", { class: "hidden" }, "Values at the cursor"),
      element("thead", {}, element("tr", {}, element("th", { class: "left", scope: "col" }, "at the cursor"),
        ...READOUT.map(([key, unit]) => element("th", { scope: "col", class: key === "mode" && "mode" }, READOUT_NAMES[key] ?? key, element("span", { class: "unit" }, unit || "\u00a0"))))),
      element("tbody", {}, ...this.held().map(({ slot, run }, i) => element("tr", {},
        element("th", { class: "left", scope: "row" }, lineDrawing(slot, "none"), ` ${slot.toUpperCase()}: ${run.name ?? `${run.variant}, ${run.scenario}, seed ${run.seed}`}`),
        ...READOUT.map(([key, , digits]) => element("td", {}, cell(columns[i], key, digits)))))));
    return columns;
  }

  moveCursor(pixels) {
    const plot = this.plots[0], width = plot.over.clientWidth;
    const now = plot.cursor.left >= 0 ? plot.cursor.left : width / 2;
    const left = Math.min(Math.max(now + pixels, 0), width - 1);
    for (const each of this.plots) each.setCursor({ left, top: 5 });
    const [values] = this.pointed(plot);
    if (values) byId("spoken").textContent = `${fixed(values.time, 3)} s: position ${fixed(values.position, 2)} mm, error ${fixed(values.error, 3)} mm, ${values.mode}`;
  }
  key(event) {
    if (!this.plots.length || event.ctrlKey || event.metaKey || event.altKey) return;
    const plot = this.plots[0], around = plot.cursor.left >= 0 ? plot.posToVal(plot.cursor.left, "x") : undefined;
    const step = event.shiftKey ? 40 : 4;
    const actions = {
      ArrowLeft: () => this.moveCursor(-step), ArrowRight: () => this.moveCursor(step), "+": () => this.zoomBy(0.5, around), "=": () => this.zoomBy(0.5, around),
      "-": () => this.zoomBy(2, around), 0: () => this.zoom(null), PageUp: () => this.pan(-0.5), PageDown: () => this.pan(0.5),
    };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  }
}

// Metrics of the runs shown, the thesis's beside them where it has the cell.
const METRICS = [
  ["rmse_mm", "RMSE, true position", "mm"], ["mae_mm", "largest error, true position", "mm"], ["rmse_measured_mm", "RMSE, measured position", "mm"],
  ["mae_measured_mm", "largest error, measured", "mm"], ["sse_mean_abs_mm", "steady state: mean |error|", "mm"], ["sse_abs_mean_mm", "steady state: |mean error|", "mm"],
  ["ssa_mm", "steady state: swing", "mm"], ["overshoot_percent", "overshoot", "%"], ["coil_switches", "coil switches", ""],
  ["air_g", "supply air", "g"], ["motor_rms_n", "motor force, RMS", "N"], ["proven_optimal_fraction", "solves proven optimal", ""],
];
const THESIS_KEYS = { rmse_mm: "rmse_mm", mae_mm: "mae_mm", rmse_measured_mm: "rmse_mm", mae_measured_mm: "mae_mm", sse_mean_abs_mm: "sse_mm", sse_abs_mean_mm: "sse_mm", ssa_mm: "ssa_mm" };

// The thesis's simulations are set against the true position, its measurements against the measured one.
function thesisFigure(run, key) {
  const measured = key.includes("measured");
  if (!run.thesis || (key.startsWith("rmse") || key.startsWith("mae") ? measured !== run.thesis.measured : false)) return undefined;
  return run.thesis[THESIS_KEYS[key]];
}

function drawMetrics(runs) {
  const shown = ["a", "b"].map((slot) => ({ slot, run: runs[slot] })).filter(({ run }) => run);
  const columns = shown.flatMap(({ slot, run }) => [
    { head: slot.toUpperCase(), value: (key) => shortNumber(Math.abs(run[key]) < 1e-9 ? 0 : run[key]) },
    ...(run.thesis ? [{ head: `thesis, ${run.thesis.measured ? "measured" : "simulated"} (Table ${run.thesis.table})`, value: (key) => thesisFigure(run, key) ?? "" }] : []),
  ]);
  byId("metrics").replaceChildren(
    element("caption", {}, "Metrics"),
    element("thead", {}, element("tr", {}, element("th", { class: "left", scope: "col" }, "metric"), ...columns.map(({ head }) => element("th", { scope: "col" }, head)), element("th", { class: "left" }, "unit"))),
    element("tbody", {}, ...METRICS.map(([key, name, unit]) => element("tr", {}, element("th", { class: "left", scope: "row" }, name),
      ...columns.map(({ value }) => element("td", {}, value(key))), element("td", { class: "left" }, unit)))));
}
