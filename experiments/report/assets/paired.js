// Variants against one of them, task by task, and performance profiles: of a ranking's `paired` (report_data.hpp).

function pairedColumns(system) {
  const number = (key, label, title) => ({ key, label, title, value: (r) => r[key], show: (r) => fixed(r[key], 4) });
  const whole = (key, label, title) => ({ key, label, title, value: (r) => r[key], show: (r) => r[key].toLocaleString("en") });
  return [
    { key: "variant", label: "Variant", left: true, header: true, value: (r) => r.variant, show: (r) => r.variant },
    number("ratio", "Ratio", `of the geometric means of the ${system.label}, over the tasks that both ended well`),
    number("low", "95 % from", "of all pairs of variants together"),
    number("high", "to", "of all pairs of variants together"),
    { key: "better", label: "Better in", unit: "% of tasks", title: "share of the tasks with the lesser error, ties are halves", value: (r) => r.better, show: (r) => fixed(r.better === null ? null : 100 * r.better, 1) },
    whole("tasks", "Tasks", "scenarios with a seed that both ended well"),
    whole("lost", "Lost", "tasks of both that the variant did not end well"),
    whole("baseline_lost", "Lost by it", "tasks of both that the variant compared with did not end well"),
    { key: "verdict", label: "Verdict", left: true, value: (r) => r.verdict, show: (r) => r.verdict ?? "-" },
  ];
}

// `chosen`: whom the others are compared with, or nothing: the best ranked.
function drawPaired(table, ranking, chosen) {
  const { paired } = ranking;
  byId("paired").hidden = !paired;
  if (!paired) return table.setRows([]);
  const compared = new Set(paired.matrix.map((row) => row.baseline));  // of very many variants one alone
  const names = ranking.variants.map(({ variant }) => variant).filter((name) => compared.has(name));
  const baseline = names.includes(chosen) ? chosen : paired.baseline;
  setOptions(byId("baseline"), names.map((name) => [name, name]));
  byId("baseline").value = baseline;
  table.setRows(paired.matrix.filter((row) => row.baseline === baseline));
  byId("paired-note").textContent = `Errors divided by those of ${baseline} in the same scenario and seed. ${paired.notes.join(" ")}`;
}

const withinFactor = ({ ok, runs, ratios }, factor) => (ratios.length ? ((ratios.filter((ratio) => ratio <= factor).length / ratios.length) * ok) / runs : 0);

function profileChart(profiles, system) {
  const said = profiles.map((p) => `${p.variant}: the least in ${percent(withinFactor(p, 1))} of the tasks, within twice in ${percent(withinFactor(p, 2))}`);
  const chart = new Chart(760, 300, `Performance profiles of the ${system.label}. ${said.join("; ")}`);
  const { left, right, top, bottom } = chart.box;
  chart.add("text", { class: "title", x: left, y: 12 }, `Share of tasks where the ${system.label} is at most \u03c4 times the least of all variants`);
  const high = Math.max(Math.SQRT2, 1.02 * Math.max(...profiles.map(({ ratios }) => ratios.at(-1) ?? 1)));
  const x = chart.scale(left, right, 1, high, true), y = chart.scale(bottom, top, 0, 1);
  const octaves = Math.floor(Math.log2(high)), step = Math.ceil((octaves + 1) / 12);
  const powers = Array.from({ length: Math.floor(octaves / step) + 1 }, (_, k) => 2 ** (k * step));
  chart.xAxis(x, high < 8 ? [1, 1.1, 1.25, 1.5, 2, 3, 4, 6].filter((tick) => tick <= high) : powers, "\u03c4, log2 scale");
  chart.yAxis(y, [0, 0.25, 0.5, 0.75, 1], "share of tasks", percent);
  profiles.forEach(({ ok, runs, ratios }, i) => {
    const points = [[1, 0], ...distributionPoints({ ok, runs, errors: ratios })].map(([ratio, share]) => `${x(ratio).toFixed(1)} ${y(share).toFixed(1)}`);
    chart.add("path", { ...lineStyle(i), d: `M${points.join("L")}H${right}` }).append(svgElement("title", {}, said[i]));
  });
  return chart.svg;
}

// Best variant first, as they are ranked.
function drawProfiles(place, ranking, system) {
  const profiles = ranking.paired?.profiles ?? [];
  place.hidden = !profiles.length;
  place.replaceChildren(...(profiles.length ? [profileChart(profiles, system), curveLegend(profiles.map((p) =>
    `${p.variant}: least in ${percent(withinFactor(p, 1))}, within twice in ${percent(withinFactor(p, 2))}, ended well ${p.ok.toLocaleString("en")} of ${p.runs.toLocaleString("en")}`))] : []));
}
