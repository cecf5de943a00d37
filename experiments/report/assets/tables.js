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

// A metric's column: its label begins with a capital, as all headings do.
const metricColumn = (metric) => ({ key: metric.key, label: capital(metric.label), unit: metric.unit, value: (row) => row[metric.key], show: metric.whole ? (row) => String(row[metric.key] ?? "-") : undefined });

// Of `system`, as report_data.hpp describes it: what variants are ranked by, what they cost.
function rankedColumns(system) {
  const { unit, label } = system;
  return [
    { key: "rank", label: "Rank", value: (v) => v.rank, show: (v) => (v.ranked ? String(v.rank) : "-") },
    { key: "variant", label: "Variant", left: true, header: true, value: (v) => v.variant, show: (v) => v.variant },
    { key: system.judged, label: capital(label), unit, best: "least", value: (v) => v[system.judged] },
    { key: "percent", label: "\u00b1", unit: "%", optional: true, title: "95 % confidence interval of the mean", value: (v) => v.percent },
    { key: system.p95, label: "95 %", unit, best: "least", optional: true, title: `95th percentile of the runs' ${label}`, value: (v) => v.spread },
    { key: system.worst, label: "Worst", unit, best: "least", title: `largest ${label} of a run`, value: (v) => v[system.worst] },
    ...system.efforts.map((effort) => ({ ...metricColumn({ ...effort, whole: false }), best: effort.best_least ? "least" : undefined })),
    { key: "solve_p50_us", label: "Solve p50", unit: "\u00b5s", best: "least", value: (v) => v.solve_p50_us },
    { key: "solve_p99_us", label: "p99", unit: "\u00b5s", best: "least", value: (v) => v.solve_p99_us },
    { key: "failed", label: "Failed", unit: "of runs", value: (v) => v.failed + v.unstable, show: (v) => `${v.failed.toLocaleString("en")} of ${v.runs.toLocaleString("en")}${v.unstable ? `, ${v.unstable.toLocaleString("en")} unstable` : ""}` },
  ];
}

function drawRanking(table, ranking, system) {
  const many = ranking.common >= MANY_SCENARIOS;
  table.setRows(ranking.variants.map((v, i) => ({
    ...v, rank: i + 1, percent: many && v.ranked ? 100 * (v[system.margin] - 1) : undefined, spread: many ? v[system.p95] : undefined })));
  const spread = many ? " \u00b1: 95 % confidence interval of the mean." : "";
  const efforts = system.efforts.map(({ label }) => label);
  const means = efforts.length ? ` ${capital(enumeration(efforts))}: ${efforts.length > 1 ? "means" : "mean"}.` : "";
  byId("ranking-note").textContent =
    `* least. ${capital(system.label)}: geometric mean of the ${system.error} over ${ranking.common.toLocaleString("en")} of ${plural(ranking.scenario_count, "scenario")} ` +
    `(those that every ranked variant finished).${means} p50: median, p99: worst run.${spread}`;
}

// Every metric that has a heading, and what the scenario was.
function runColumns(system, deadline_us) {
  return [
    { key: "scenario", label: "Scenario", left: true, value: (r) => r.scenario, show: (r) => r.scenario },
    { key: "variant", label: "Variant", left: true, header: true, value: (r) => r.variant, show: (r) => r.variant },
    { key: "seed", label: "Seed", value: (r) => r.seed, show: (r) => String(r.seed) },
    ...system.conditions.map((condition) => metricColumn(condition)),
    ...system.metrics.filter(({ heading }) => heading).flatMap((metric) => [metricColumn(metric), ...thesisColumns(metric.key)]),
    { key: "p99", label: "Solve p99", unit: "\u00b5s", value: (r) => r.solve_us?.p99 },
    { key: "deadline_misses", label: "Late", unit: "solves", title: `solves longer than the period of ${duration(deadline_us)}`, value: (r) => r.deadline_misses, show: (r) => String(r.deadline_misses ?? "-") },
    { key: "status", label: "Status", left: true, value: (r) => r.status, show: (r) => r.status, bad: (r) => r.status !== "ok" },
  ];
}
