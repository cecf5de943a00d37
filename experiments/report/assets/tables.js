// Tables that sort by any column.

// columns: {key, label, unit, left, value(row) -> number or text, show(row) -> text or node, best: "least"}.
class SortedTable {
  constructor(table, columns, caption, sort) {
    this.table = table;
    this.columns = columns;
    this.sort = sort;  // {key, descending}
    this.head = element("tr");
    this.body = element("tbody");
    table.replaceChildren(element("caption", { class: "hidden" }, caption), element("thead", {}, this.head), this.body);
    this.rows = [];
  }
  setRows(rows, limit = Infinity) {
    this.rows = rows;
    this.limit = limit;
    this.draw();
  }
  shownColumns() {
    return this.columns.filter((column) => !column.optional || this.rows.some((row) => column.value(row) !== undefined));
  }
  sortBy(key) {
    this.sort = { key, descending: this.sort.key === key && !this.sort.descending };
    this.draw();
    this.head.querySelector(`[data-key="${key}"] button`)?.focus();
  }
  sorted() {
    const column = this.columns.find(({ key }) => key === this.sort.key);
    if (!column) return this.rows;
    const sign = this.sort.descending ? -1 : 1;
    const missing = (value) => value === undefined || value === null || Number.isNaN(value);
    return this.rows.map((row, place) => ({ row, place, value: column.value(row) })).sort((a, b) => {
      if (missing(a.value) || missing(b.value)) return missing(a.value) - missing(b.value) || a.place - b.place;
      const order = typeof a.value === "string" ? a.value.localeCompare(b.value, "en", { numeric: true }) : a.value - b.value;
      return sign * order || a.place - b.place;
    }).map(({ row }) => row);
  }
  draw() {
    const columns = this.shownColumns();
    this.head.replaceChildren(...columns.map((column) => this.heading(column)));
    const best = new Map(columns.filter((column) => column.best).map((column) => {
      const values = this.rows.map(column.value).filter((value) => value !== undefined);
      return [column.key, values.length > 1 ? Math.min(...values) : undefined];
    }));
    const body = document.createDocumentFragment();
    for (const row of this.sorted().slice(0, this.limit)) body.append(this.line(row, columns, best));
    this.body.replaceChildren(body);
  }
  heading(column) {
    const unit = column.unit ? element("span", { class: "unit" }, column.unit) : undefined;
    if (column.fixed) return element("th", { scope: "col", class: `left ${column.css}` }, column.label);
    const order = this.sort.key !== column.key ? "none" : this.sort.descending ? "descending" : "ascending";
    return element("th", { scope: "col", class: column.left && "left", "aria-sort": order, "data-key": column.key, title: column.title },
      element("button", { type: "button", onclick: () => this.sortBy(column.key) }, column.label), unit);
  }
  line(row, columns, best) {
    const line = element("tr");
    for (const column of columns) {
      const shown = column.show ? column.show(row) : shortNumber(column.value(row));
      const isBest = best.get(column.key) !== undefined && column.value(row) === best.get(column.key);
      const classes = [column.css, column.left && "left", isBest && "best", column.best && "marked", column.bad?.(row) && "bad"].filter(Boolean);
      line.append(element(column.header ? "th" : "td", { class: classes.join(" ") || undefined, scope: column.header && "row" }, shown));
    }
    return line;
  }
}

const RANKED_COLUMNS = [
  { key: "rank", label: "Rank", value: (v) => v.rank, show: (v) => (v.ranked ? String(v.rank) : "-") },
  { key: "variant", label: "Variant", left: true, header: true, value: (v) => v.variant, show: (v) => v.variant },
  { key: "rmse_mm", label: "RMSE", unit: "mm", best: "least", value: (v) => v.rmse_mm },
  { key: "margin", label: "\u00b1", unit: "%", optional: true, title: "95 % confidence interval of the mean", value: (v) => v.margin },
  { key: "p95_rmse_mm", label: "95 %", unit: "mm", best: "least", optional: true, title: "95th percentile of the runs' RMSE", value: (v) => v.p95 },
  { key: "worst_rmse_mm", label: "Worst", unit: "mm", best: "least", title: "largest RMSE of a run", value: (v) => v.worst_rmse_mm },
  { key: "switches_per_s", label: "Switches", unit: "1/s", best: "least", value: (v) => v.switches_per_s },
  { key: "air_g", label: "Air", unit: "g", best: "least", value: (v) => v.air_g },
  { key: "solve_p50_us", label: "Solve p50", unit: "\u00b5s", best: "least", value: (v) => v.solve_p50_us },
  { key: "solve_p99_us", label: "p99", unit: "\u00b5s", best: "least", value: (v) => v.solve_p99_us },
  { key: "failed", label: "Failed", unit: "of runs", value: (v) => v.failed + v.unstable, show: (v) => `${v.failed} of ${v.runs}${v.unstable ? `, ${v.unstable} unstable` : ""}` },
];

function drawRanking(table, ranking) {
  const many = ranking.common >= MANY_SCENARIOS;
  table.setRows(ranking.variants.map((v, i) => ({
    ...v, rank: i + 1, margin: many && v.ranked ? 100 * (v.rmse_margin - 1) : undefined, p95: many ? v.p95_rmse_mm : undefined })));
  const spread = many ? " \u00b1: 95 % confidence interval of the mean." : "";
  byId("ranking-note").textContent =
    `* least. RMSE: geometric mean of the true position's over ${ranking.common} of ${plural(ranking.scenarios.length, "scenario")} ` +
    `(those that every ranked variant finished). Switches and air: means. p50: median, p99: worst run.${spread}`;
}

const thesisNumber = (text) => (text === undefined ? undefined : Number(text.replace("<", "")));

const RUN_COLUMNS = [
  { key: "scenario", label: "Scenario", left: true, value: (r) => r.scenario, show: (r) => r.scenario },
  { key: "variant", label: "Variant", left: true, header: true, value: (r) => r.variant, show: (r) => r.variant },
  { key: "seed", label: "Seed", value: (r) => r.seed, show: (r) => String(r.seed) },
  { key: "payload_kg", label: "Payload", unit: "kg", value: (r) => r.payload_kg },
  { key: "rmse_mm", label: "RMSE", unit: "mm", value: (r) => r.rmse_mm },
  { key: "thesis_rmse", label: "Thesis", unit: "mm", optional: true, title: "RMSE in the thesis's table", value: (r) => thesisNumber(r.thesis?.rmse_mm),
    show: (r) => (r.thesis ? element("span", { title: `Table ${r.thesis.table}, ${r.thesis.measured ? "measured" : "simulated"}` }, r.thesis.rmse_mm) : "-") },
  { key: "mae_mm", label: "Largest error", unit: "mm", value: (r) => r.mae_mm },
  { key: "thesis_mae", label: "Thesis", unit: "mm", optional: true, title: "MAE in the thesis's table", value: (r) => thesisNumber(r.thesis?.mae_mm),
    show: (r) => (r.thesis ? element("span", { title: `Table ${r.thesis.table}, ${r.thesis.measured ? "measured" : "simulated"}` }, r.thesis.mae_mm) : "-") },
  { key: "rmse_measured_mm", label: "Measured RMSE", unit: "mm", value: (r) => r.rmse_measured_mm },
  { key: "switches_per_s", label: "Switches", unit: "1/s", value: (r) => r.switches_per_s },
  { key: "air_g", label: "Air", unit: "g", value: (r) => r.air_g },
  { key: "motor_rms_n", label: "Motor RMS", unit: "N", value: (r) => r.motor_rms_n },
  { key: "p99", label: "Solve p99", unit: "\u00b5s", value: (r) => r.solve_us?.p99 },
  { key: "deadline_misses", label: "Late", unit: "solves", title: "solves longer than the 5 ms period", value: (r) => r.deadline_misses, show: (r) => String(r.deadline_misses ?? "-") },
  { key: "status", label: "Status", left: true, value: (r) => r.status, show: (r) => r.status, bad: (r) => r.status !== "ok" },
];
