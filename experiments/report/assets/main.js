// Puts the page together.

const RUNS_AT_ONCE = 100;

class Page {
  constructor(report) {
    this.report = report;
    this.limit = RUNS_AT_ONCE;
    this.chosen = { a: "", b: "" };
    this.ranked = new SortedTable(byId("ranked"), rankedColumns(report.system), `Variants ranked by the geometric mean of their ${report.system.label}`, { key: "rank", descending: false });
    this.pairedTable = new SortedTable(byId("paired-table"), pairedColumns(report.system), "Variants against one of them, task by task", { key: "", descending: false });
    this.baseline = "";  // whom the reader compares with; empty: the best ranked
    const pick = {
      key: "pick", label: "Plot", fixed: true, left: true, css: "on-screen", value: () => "",
      show: (run) => element("span", {}, ...["a", "b"].map((slot) => element("button", {
        type: "button", class: `pick ${slot}`, "data-slot": slot, "aria-pressed": String(this.chosen[slot] === run.id),
        "aria-label": `Plot ${run.scenario}, ${run.variant}, seed ${run.seed} as run ${slot.toUpperCase()}`, onclick: () => this.choose(slot, this.chosen[slot] === run.id && slot === "b" ? "" : run.id) },
        slot.toUpperCase()))),
    };
    this.runTable = new SortedTable(byId("run-table"), [pick, ...runColumns(report.system, report.deadline_us)], "Runs", { key: "", descending: false });
    this.curves = new Curves(byId("curves"));
    this.listen();
    this.update(report);
  }

  listen() {
    byId("group").addEventListener("change", () => this.drawGroup());
    byId("baseline").addEventListener("change", (event) => { this.baseline = event.target.value; this.drawGroup(); });
    for (const id of ["search", "scenario", "variant", "status"]) byId(id).addEventListener("input", () => { this.limit = RUNS_AT_ONCE; this.drawRuns(); });
    byId("more").addEventListener("click", () => { this.limit += 5 * RUNS_AT_ONCE; this.drawRuns(); });
    for (const slot of ["a", "b"]) byId(`run-${slot}`).addEventListener("change", (event) => this.choose(slot, event.target.value));
    byId("zoom-in").addEventListener("click", () => this.curves.zoomBy(0.5));
    byId("zoom-out").addEventListener("click", () => this.curves.zoomBy(2));
    byId("pan-left").addEventListener("click", () => this.curves.pan(-0.5));
    byId("pan-right").addEventListener("click", () => this.curves.pan(0.5));
    byId("zoom-all").addEventListener("click", () => this.curves.zoom(null));
  }

  update(report) {
    this.report = report;
    const stored = this.growing && report.runs.find((run) => run.id === this.growing.run);
    if (stored) {
      this.growing = null;
      this.followed = stored.id;  // the next run takes its place, unless another is chosen meanwhile
    }
    const { manifest } = report;
    const program = manifest.program ?? {};
    byId("title").textContent = report.campaign || "Solenoid report";
    document.title = `${report.campaign}: Solenoid report`;
    const ended = ["ok", "unstable", "failed"].filter((status) => report.counts[status]).map((status) => `${report.counts[status].toLocaleString("en")} ${status}`);
    const damaged = report.left_out ?? [], missing = damaged.filter((run) => !run.in_part), cut = damaged.filter((run) => run.in_part);
    const absent = Math.max(missing.length, report.status === "running" ? 0 : manifest.counts?.missing ?? 0);
    byId("subtitle").textContent = [
      absent && `${plural(absent, "run")} missing`,
      `${plural(report.counts.runs, "run")}${ended.length ? ": " + ended.join(", ") : ""}`,
      report.status, (manifest.ended ?? manifest.started ?? "").replace("T", " ").slice(0, 16), report.generator].filter(Boolean).join(" \u00b7 ");
    const reasons = (runs) => runs.map(({ id, reason }) => `${id} (${reason})`).join("; ");
    const told = [missing.length && `Missing because their files are damaged: ${reasons(missing)}`, cut.length && `Logs that are not whole: ${reasons(cut)}`];
    if (damaged.length) this.fail(told.filter(Boolean).join(". "));
    setOptions(byId("group"), report.rankings.map((ranking, i) => [String(i), ranking.name]));
    const names = (key) => [...new Set(report.runs.map((run) => run[key]))];
    setOptions(byId("scenario"), [["", "all"], ...names("scenario").map((name) => [name, name])]);
    setOptions(byId("variant"), [["", "all"], ...names("variant").map((name) => [name, name])]);
    setOptions(byId("status"), [["", "all"], ["ok", "ok"], ["unstable", "unstable"], ["failed", "failed"]]);
    this.runsById = new Map(report.runs.map((run, index) => [run.id, { run, index }]));
    const label = (run) => `${run.scenario} \u00b7 ${run.variant} \u00b7 seed ${run.seed}`;
    const choices = report.runs.map((run) => [run.id, label(run)]);
    if (this.growing) choices.unshift([LIVE_RUN.id, `now running: ${this.growing.run}`]);
    setOptions(byId("run-a"), choices.length ? choices : [["", "no run yet"]]);
    setOptions(byId("run-b"), [["", "none"], ...choices]);
    this.drawGroup();
    this.drawRuns();
    this.drawSetup();
    for (const slot of ["a", "b"]) if (stored && this.chosen[slot] === LIVE_RUN.id) this.choose(slot, stored.id);
    if (!this.chosen.a && report.runs.length) this.choose("a", this.bestRun());
  }

  // Of the variant in first place, in the first scenario; with curves, if any run has them.
  bestRun() {
    const { rankings, runs } = this.report, first = rankings[0]?.variants[0]?.variant;
    const best = [(run) => run.variant === first && run.trace !== "none", (run) => run.trace !== "none", (run) => run.variant === first && run.status === "ok"];
    return (best.map((wanted) => runs.find(wanted)).find(Boolean) ?? runs[0]).id;
  }

  drawGroup() {
    const ranking = this.report.rankings[Number(byId("group").value)] ?? this.report.rankings[0];
    drawRanking(this.ranked, ranking, this.report.system);
    drawPareto(byId("pareto"), ranking, this.report.system);
    drawPaired(this.pairedTable, ranking, this.baseline);
    drawProfiles(byId("profile"), ranking, this.report.system);
    drawDistribution(byId("distribution"), ranking, this.report.system);
    drawSolveTimes(this.report, ranking);
    byId("solve-note").textContent = `all solves over ${ranking.name}; one control period is ${duration(this.report.deadline_us)}; bins of a tenth of a decade`;
  }

  drawRuns() {
    const text = byId("search").value.trim().toLowerCase().split(/\s+/).filter(Boolean);
    const wanted = { scenario: byId("scenario").value, variant: byId("variant").value };
    const status = byId("status").value;
    const rows = this.report.runs.filter((run) => {
      const all = `${run.scenario} ${run.variant} ${run.trajectory} seed ${run.seed} ${run.status}`.toLowerCase();
      return text.every((word) => all.includes(word)) && Object.entries(wanted).every(([key, value]) => !value || run[key] === value) && run.status.startsWith(status);
    });
    this.runTable.setRows(rows, this.limit);
    const { sample, counts, runs } = this.report;
    byId("count").textContent = `${rows.length.toLocaleString("en")} of ${plural(runs.length, sample ? "listed run" : "run")}${sample ? `, of ${counts.runs.toLocaleString("en")}` : ""}`;
    byId("more").hidden = rows.length <= this.limit;
    byId("more").textContent = `Show more (${Math.max(0, rows.length - this.limit)} left)`;
    byId("runs-note").textContent = [sample && `${plural(runs.length, "run")} of ${counts.runs.toLocaleString("en")} are listed: of each variant those with the largest errors, others at evenly spaced ranks ` +
      "of the error, the first that were unstable or failed. Ranking, distribution and solver times are over all; runs.csv has every run.",
      rows.some((run) => run.thesis) && "Thesis: what its tables print for the same law, motion and payload; tables 6-1 and 6-2 are simulated, 7-1 to 7-9 measured on its rig."].filter(Boolean).join(" ");
  }

  choose(slot, id) {
    this.chosen[slot] = id;
    byId(`run-${slot}`).value = id;
    for (const button of byId("run-table").querySelectorAll(`.pick[data-slot="${slot}"]`)) button.setAttribute("aria-pressed", "false");
    this.runTable.draw();
    const found = this.runsById.get(id);
    drawMetrics(this.report.system, { a: this.runsById.get(this.chosen.a)?.run, b: this.runsById.get(this.chosen.b)?.run });
    if (id === LIVE_RUN.id) return this.holdGrowing(slot);
    return this.curves.show(slot, found?.run, found?.index).catch((problem) => this.fail(`Curves of ${id}: ${problem.message}`));
  }

  // The run under way, if the program sends one.
  showGrowing(trace, id) {
    const fresh = this.growing?.run !== id.split("#")[0];
    this.growing = { id, run: id.split("#")[0], trace };
    if (fresh) this.update(this.report);
    if (fresh && (!this.chosen.a || this.chosen.a === this.followed)) this.choose("a", LIVE_RUN.id);
    for (const slot of ["a", "b"]) if (this.chosen[slot] === LIVE_RUN.id) this.holdGrowing(slot);
  }
  holdGrowing(slot) {
    const before = this.curves.slots[slot];
    const fresh = before?.run !== LIVE_RUN;
    LIVE_RUN.name = `now running: ${this.growing.run}`;
    this.curves.slots[slot] = { run: LIVE_RUN, index: -1, overview: this.growing.trace, full: this.growing.trace };
    if (fresh) this.curves.draw();
    else this.curves.refresh();
  }

  drawSetup() {
    const { manifest, system: { modes_key } } = this.report;
    const program = manifest.program ?? {}, machine = manifest.machine ?? {};
    const entries = [
      ["Campaign", `${manifest.campaign}: ${this.report.folder_name}`],
      ["Program", [program.version, program.git_revision && `revision ${program.git_revision}`, program.compiler, program.build_type].filter(Boolean).join(", ")],
      ["Machine", [machine.host, machine.cpu, machine.cores && plural(machine.cores, "core"), machine.kernel].filter(Boolean).join(", ")],
      ["Jobs", manifest.jobs], ["Seeds", (manifest.seeds ?? []).join(", ")],
      ["Started", manifest.started], ["Ended", manifest.ended ?? "not yet"], ["Reason", manifest.reason],
    ];
    byId("machine").replaceChildren(...entries.filter(([, value]) => value !== undefined && value !== "").flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, String(value))]));
    byId("variants").replaceChildren(
      element("thead", {}, element("tr", {}, ...["Variant", capital(modes_key), "Solver", "Estimator", "Summary"].map((head) => element("th", { class: "left", scope: "col" }, head)))),
      element("tbody", {}, ...this.report.variants.map((v) => element("tr", {}, element("th", { class: "left", scope: "row" }, v.name),
        ...[v[modes_key], v.solver, v.estimator, v.summary].map((text) => element("td", { class: "left" }, text))))));
    byId("toml").textContent = this.report.resolved_toml;
    byId("manifest").textContent = JSON.stringify(manifest, null, 2);
  }

  fail(text) {
    byId("trouble").hidden = false;
    byId("trouble").textContent = text;
  }
}

const THEMES = ["system", "light", "dark"];
const systemDark = matchMedia("(prefers-color-scheme: dark)");
let theme = "system", printing = false;

// Paper is light, whatever the screen is.
function applyTheme() {
  const dark = !printing && (theme === "dark" || (theme === "system" && systemDark.matches));
  document.documentElement.dataset.theme = dark ? "dark" : "light";
  byId("theme").textContent = `Theme: ${theme}`;
  page?.curves.draw();
}

let page = null;
byId("theme").addEventListener("click", () => { theme = THEMES[(THEMES.indexOf(theme) + 1) % THEMES.length]; applyTheme(); });
systemDark.addEventListener("change", applyTheme);
addEventListener("beforeprint", () => { printing = true; document.body.style.width = "1040px"; applyTheme(); });
addEventListener("afterprint", () => { printing = false; document.body.style.width = ""; applyTheme(); });
applyTheme();
page = new Page(JSON.parse(byId("data").textContent));
if (page.report.live) new Live(page);
document.documentElement.dataset.ready = "true";
