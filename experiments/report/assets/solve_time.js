// How long solves took: a histogram a variant, ten bins a decade, with the line of the control period.

const BINS_A_DECADE = 10;

function histogramChart(name, histogram, range, summary, deadline) {
  const chart = new Chart(330, 190, `Solver time of ${name}: ${summary}`);
  const { left, right, top, bottom } = chart.box;
  chart.add("text", { class: "title", x: left, y: 12 }, name);
  const most = Math.max(10, 10 ** Math.ceil(Math.log10(range.most * 1.01)));
  const x = chart.scale(left, right, 10 ** (range.first / BINS_A_DECADE), 10 ** (range.end / BINS_A_DECADE), true);
  const y = chart.scale(bottom, top, 0.7, most, true);
  const decades = [];
  for (let power = Math.ceil(range.first / BINS_A_DECADE); power <= range.end / BINS_A_DECADE; ++power) decades.push(10 ** power);
  chart.xAxis(x, decades, "time of a solve", duration);
  chart.yAxis(y, logTicks(1, most).filter((tick) => Number.isInteger(Math.log10(tick))), "solves, log scale");
  histogram.counts.forEach((count, i) => {
    if (!count) return;
    const low = 10 ** ((histogram.first + i) / BINS_A_DECADE), high = 10 ** ((histogram.first + i + 1) / BINS_A_DECADE);
    chart.add("rect", { class: low >= deadline * 0.999 ? "bin late" : "bin", x: x(low) + 0.4, width: Math.max(0.5, x(high) - x(low) - 0.8), y: y(count), height: bottom - y(count) })
      .append(svgElement("title", {}, `${shortNumber(low)} to ${shortNumber(high)} \u00b5s: ${plural(count, "solve")}`));
  });
  chart.add("line", { class: "deadline", x1: x(deadline), x2: x(deadline), y1: top - 4, y2: bottom });
  chart.add("text", { class: "deadline-text", x: x(deadline) + 3, y: top + 4 }, duration(deadline));
  chart.add("text", { class: "quiet", x: right, y: 12, "text-anchor": "end" }, summary);
  return chart.svg;
}

// Sums over all runs of the scenarios compared, listed or not.
function drawSolveTimes(report, ranking) {
  const rows = report.variants.flatMap(({ name }) => ranking.variants.filter((v) => v.variant === name && v.solves.counts.length))
    .map(({ variant, solves }) => ({ variant, histogram: solves, late: solves.late }));
  const place = byId("histograms");
  if (!rows.length) {
    place.replaceChildren(element("p", { class: "note" }, "No run with recorded solver times."));
    return;
  }
  const deadlineBin = BINS_A_DECADE * Math.log10(report.deadline_us);
  const range = {
    first: BINS_A_DECADE * Math.floor(Math.min(...rows.map((row) => row.histogram.first)) / BINS_A_DECADE),
    end: Math.max(deadlineBin + 5, ...rows.map((row) => row.histogram.first + row.histogram.counts.length)),
    most: Math.max(...rows.map((row) => Math.max(...row.histogram.counts))),
  };
  place.replaceChildren(...rows.map((row) => {
    const total = row.histogram.counts.reduce((sum, count) => sum + count, 0);
    const summary = `${total.toLocaleString("en")} solves, ${row.late ? row.late.toLocaleString("en") : "none"} late`;
    return histogramChart(row.variant, row.histogram, range, summary, report.deadline_us);
  }));
}
