// The plots over one time axis, as the run's header has them: its system's panels (trace_layout.hpp).

const LEFT = 70, RIGHT = 128, TIME_AXIS = 38;  // px beside and below the plots
const DASHES = [undefined, [3, 3], [9, 3, 2, 3], [1, 3]];  // of curves of one panel
const DESIRED_DASH = [7, 5];
const LEAST_TICKS = 10;  // that a zoomed view is wide

// px: a motion that is followed has the most room for its shape, names of modes need a line each.
const heightOf = (panel) => (panel.modes ? 126 : panel.limit > 0 ? 90 : panel.curves.some(({ desired }) => desired) ? 112 : 96);
const panelLabel = ({ label, unit }) => (unit ? `${label} [${unit}]` : label);

// Text beside an axis of `room` px: smaller if it must be, then cut, but for the unit. The legend names the curves in full.
function fittingLabel({ label, unit }, room) {
  const most = (size) => Math.floor(room / (0.52 * size)), whole = panelLabel({ label, unit });
  const size = [12, 11, 10].find((candidate) => whole.length <= most(candidate));
  if (size) return { text: whole, size };
  const left = Math.max(3, most(10) - panelLabel({ label: "\u2026", unit }).length);
  return { text: panelLabel({ label: `${label.slice(0, left)}\u2026`, unit }), size: 10 };
}

// Each curve that is desired before the one that is to follow it.
function desiredFirst(curves) {
  const list = [];
  for (const curve of curves) list.splice(curve.desired && list.length && !list.at(-1).desired ? -1 : list.length, 0, curve);
  return list;
}
const actualCurves = (panel) => panel.curves.filter(({ desired }) => !desired);

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
    this.panels = [];                   // those that are drawn
    this.modes = [];
    this.chosen = {};                   // label of the panel by the name of its choice
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
    if (!this.held().length) return;
    const whole = this.whole();
    if (view) {
      const width = Math.max(LEAST_TICKS * this.tick(), view.to - view.from);
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
      for (const name of overview.header.modes) if (!this.modes.includes(name)) this.modes.push(name);
  }
  header() { return this.held()[0].overview.header; }
  tick() { return Math.min(...this.held().map(({ overview }) => overview.header.tick_s)); }
  // In what people read times: brief runs in ms. {unit, scale, digits}
  timeUnit() {
    const { from, to } = this.whole(), brief = to - from < 0.101;
    return { unit: brief ? "ms" : "s", scale: brief ? 1e3 : 1, digits: Math.max(3, decimalsOf((brief ? 1e3 : 1) * this.tick())) };
  }
  timeText(time) {
    const { scale, digits } = this.timeUnit();
    return fixed(scale * time, digits);
  }

  // Panels of one choice share a place; which of them has it is chosen in a list beside the buttons.
  collectPanels() {
    const { panels } = this.header();
    const groups = new Map();
    for (const panel of panels) if (panel.choice) groups.set(panel.choice, [...(groups.get(panel.choice) ?? []), panel.label]);
    for (const [choice, labels] of groups) if (!labels.includes(this.chosen[choice])) this.chosen[choice] = labels[0];
    this.panels = panels.filter(({ choice, label }) => !choice || this.chosen[choice] === label);
    const place = byId("choices"), shape = JSON.stringify([...groups]);
    place.hidden = groups.size === 0;
    if (place.dataset.shape === shape) return;
    place.dataset.shape = shape;
    place.replaceChildren(...[...groups].map(([choice, labels]) => {
      const select = element("select", { id: `choice-${choice}` });
      setOptions(select, labels.map((label) => [label, label]));
      select.value = this.chosen[choice];
      select.addEventListener("change", () => { this.chosen[choice] = select.value; this.draw(); });
      return element("label", {}, `${capital(choice)} plot `, select);
    }));
  }
  // Curves that a run has: another variant's may lack one. What run B is to follow is drawn where it is another than A's.
  curvesOf(panel, held) {
    const again = held.slot === "b" && this.slots.a?.overview && this.slots.a.run.scenario === held.run.scenario;
    return panel.curves.filter(({ signal, desired }) => held.overview[signal] && !(desired && again));
  }

  dataOf(panel) {
    const { from, to } = this.range();
    const tables = this.held().map((held) => {
      const trace = this.traceOf(held);
      const names = this.curvesOf(panel, held).map(({ signal }) => signal);
      const part = windowOf(trace, names, from, to, Math.max(300, this.place.clientWidth - LEFT - RIGHT));
      const { modes } = trace.header;
      if (panel.modes) for (const name of names) part[name] = part[name].map((mode) => (modes[mode] === undefined ? null : this.modes.indexOf(modes[mode])));
      return [part.time, ...names.map((name) => part[name])];
    });
    return tables.length > 1 ? uPlot.join(tables) : tables[0];
  }

  seriesOf(panel) {
    const series = [{}];
    for (const held of this.held())
      for (const curve of this.curvesOf(panel, held))
        series.push({
          stroke: curve.desired ? (held.slot === "a" ? colour("reference") : colour("b")) : colour(held.slot),
          width: curve.desired ? 1 : panel.modes ? 0.9 : 1.4,
          dash: curve.desired ? DESIRED_DASH : DASHES[actualCurves(panel).indexOf(curve) % DASHES.length],
          paths: panel.modes ? uPlot.paths.stepped({ align: 1 }) : uPlot.paths.linear(),
          points: { show: false },
          spanGaps: this.held().length > 1,
        });
    return series;
  }

  limits(panel, low, high) {
    if (panel.modes) return [-0.5, this.modes.length - 0.5];
    if (panel.limit > 0) {
      const limits = this.held().flatMap(({ overview }) => overview.header.panels.filter(({ label }) => label === panel.label).map(({ limit }) => limit));
      const limit = 1.1 * Math.max(...limits, panel.limit);
      return [Math.min(-limit, low ?? 0), Math.max(limit, high ?? 0)];
    }
    if (low === null || low === undefined) return [-1, 1];
    if (panel.zero) { low = Math.min(low, 0); high = Math.max(high, 0); }
    const margin = 0.06 * Math.max(high - low, 10 * this.stepOf(panel.curves[0].signal));
    return [low - margin, high + margin];
  }
  // A signal's resolution, in the unit that people read it in.
  stepOf(signal) { return this.header().shown[signal].step; }

  axesOf(panel, last) {
    const font = "12px system-ui, 'Liberation Sans', sans-serif", grid = { stroke: colour("grid"), width: 1 };
    const common = { stroke: colour("quiet"), font, labelFont: font, grid, ticks: { ...grid, size: 4 } };
    const { unit, scale } = this.timeUnit();
    const text = (value, digits) => String(Number(value.toPrecision(digits))).replace("-", "\u2212");
    const time = last
      ? { ...common, label: `time [${unit}]`, labelSize: 16, size: TIME_AXIS - 16, gap: 2, values: (u, splits) => splits.map((value) => text(scale * value, 9)) }
      : { ...common, size: 0, values: () => [], ticks: { show: false } };
    const label = fittingLabel(panel, this.heightOf(panel));
    const value = { ...common, label: label.text, labelFont: font.replace("12px", `${label.size}px`), labelSize: 18, size: LEFT - 18, gap: 3, space: 24, values: (u, splits) => splits.map((v) => text(v, 6)) };
    if (!panel.modes) return [time, value];
    const splits = () => this.modes.map((name, i) => i);
    const small = `${this.modes.length > 4 ? 10 : 11}px system-ui, 'Liberation Sans', sans-serif`;
    return [time, { ...value, splits }, { ...common, side: 1, size: RIGHT, gap: 4, font: small, grid: { show: false }, splits, values: () => this.modes }];
  }

  heightOf(panel) { return heightOf(panel) + (panel.modes ? 12 * Math.max(0, this.modes.length - 9) : 0); }
  optionsOf(panel, last) {
    const height = this.heightOf(panel) + (last ? TIME_AXIS : 0);
    return {
      width: Math.max(320, this.place.clientWidth), height, legend: { show: false }, focus: { alpha: 1 },
      padding: [5, panel.modes ? 0 : RIGHT, last ? 0 : 4, 0],
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
    this.collectPanels();
    this.collectModes();
    byId("legend").replaceChildren(...this.legend());
    for (const panel of this.panels) {
      const box = element("div", { role: "img" });
      this.place.append(box);
      this.plots.push(new uPlot(this.optionsOf(panel, panel === this.panels.at(-1)), this.dataOf(panel), box));
    }
    this.describe();
    this.pointed(this.plots[0]);
  }
  refresh() {
    if (!this.plots.length) return;
    this.plots.forEach((plot, i) => plot.setData(this.dataOf(this.panels[i])));
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
    const dashed = (name, dash, label) => element("span", {}, lineDrawing(name, dash?.join(" ") ?? "none"), ` ${label}`);
    const entries = [];
    if (this.panels.some(({ curves }) => curves.some(({ desired }) => desired))) entries.push(dashed("reference", DESIRED_DASH, "desired"));
    for (const panel of this.panels)
      if (actualCurves(panel).length > 1) actualCurves(panel).forEach(({ label }, i) => entries.push(dashed("quiet", DASHES[i % DASHES.length], label)));
    if (this.held().some(({ overview }) => overview.header.measured)) entries.push(element("span", {}, "as measured"));
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
      plot.root.parentNode.setAttribute("aria-label", `${panelLabel(this.panels[i])}, ${this.timeText(from)} to ${this.timeText(to)} ${this.timeUnit().unit}: ${spans}`);
    });
  }

  selected(plot) {
    const { left, width } = plot.select;
    if (width < 4) return;
    const from = plot.posToVal(left, "x"), to = plot.posToVal(left + width, "x");
    for (const each of this.plots) each.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
    this.zoom({ from, to });
  }

  // What the cursor reads out, of all panels: [{signal, label, unit, digits}].
  readouts() {
    const list = [{ signal: "time", label: "time", ...this.timeUnit() }];
    for (const panel of this.header().panels)
      for (const { signal, label } of desiredFirst(panel.curves))
        if (!list.some((entry) => entry.signal === signal))
          list.push({ signal, label, unit: panel.unit, modes: panel.modes, digits: Math.max(0, Math.floor(1e-9 - Math.log10(this.stepOf(signal))) - 1) });
    return list;
  }
  // Texts by signal.
  valuesAt(time) {
    return this.held().map((held) => {
      const trace = held.full ?? held.overview;
      let i = Math.min(lowerBound(trace.time, time), trace.time.length - 1);
      if (i > 0 && time - trace.time[i - 1] < trace.time[i] - time) --i;
      const text = ({ signal, modes, digits }) => (modes ? trace.header.modes[trace[signal]?.[i]] ?? "-" : fixed(trace[signal]?.[i], digits));
      return Object.fromEntries(this.readouts().map((entry) => [entry.signal, entry.signal === "time" ? this.timeText(trace.time[i]) : text(entry)]));
    });
  }
  pointed(plot) {
    const { left } = plot?.cursor ?? {};
    const over = left >= 0 && left !== null;
    const columns = over ? this.valuesAt(plot.posToVal(left, "x")) : this.held().map(() => null);
    const readouts = this.readouts();
    byId("readout").replaceChildren(
      element("caption", { class: "hidden" }, "Values at the cursor"),
      element("thead", {}, element("tr", {}, element("th", { class: "left", scope: "col" }, "at the cursor"),
        ...readouts.map(({ label, unit, modes }) => element("th", { scope: "col", class: modes && "mode" }, label, element("span", { class: "unit" }, unit || "\u00a0"))))),
      element("tbody", {}, ...this.held().map(({ slot, run }, i) => element("tr", {},
        element("th", { class: "left", scope: "row" }, lineDrawing(slot, "none"), ` ${slot.toUpperCase()}: ${run.name ?? `${run.variant}, ${run.scenario}, seed ${run.seed}`}`),
        ...readouts.map(({ signal }) => element("td", {}, columns[i]?.[signal] ?? ""))))));
    return columns;
  }

  // For who hears the page: what is followed, how far it is off, the mode. Panels behind the modes are what they cause.
  spokenText(values) {
    const parts = [];
    for (const panel of this.panels) {
      const curves = actualCurves(panel);
      parts.push(...curves.map(({ signal, label }) => `${curves.length > 1 ? label : panel.label} ${values[signal]}${panel.unit && ` ${panel.unit}`}`));
      if (panel.modes) break;
    }
    return `${values.time} ${this.timeUnit().unit}: ${parts.join(", ")}`;
  }
  moveCursor(pixels) {
    const plot = this.plots[0], width = plot.over.clientWidth;
    const now = plot.cursor.left >= 0 ? plot.cursor.left : width / 2;
    const left = Math.min(Math.max(now + pixels, 0), width - 1);
    for (const each of this.plots) each.setCursor({ left, top: 5 });
    const [values] = this.pointed(plot);
    if (values) byId("spoken").textContent = this.spokenText(values);
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
function drawMetrics(system, runs) {
  const shown = ["a", "b"].map((slot) => ({ slot, run: runs[slot] })).filter(({ run }) => run);
  const columns = shown.flatMap(({ slot, run }) => [
    { head: slot.toUpperCase(), value: (key) => shortNumber(Math.abs(run[key]) < 1e-9 ? 0 : run[key]) },
    ...(run.thesis ? [{ head: thesisHeading(run), value: (key) => thesisFigure(run, key) ?? "" }] : []),
  ]);
  const rows = [...system.metrics.map(({ key, label, unit }) => ({ key, unit, name: key === system.judged ? `${label}, ${system.error}` : label })),
    { key: "proven_optimal_fraction", name: "solves proven optimal", unit: "" }];
  byId("metrics").replaceChildren(
    element("caption", {}, "Metrics"),
    element("thead", {}, element("tr", {}, element("th", { class: "left", scope: "col" }, "metric"), ...columns.map(({ head }) => element("th", { scope: "col" }, head)), element("th", { class: "left" }, "unit"))),
    element("tbody", {}, ...rows.map(({ key, name, unit }) => element("tr", {}, element("th", { class: "left", scope: "row" }, name),
      ...columns.map(({ value }) => element("td", {}, value(key))), element("td", { class: "left" }, unit)))));
}
