// How the errors of each variant's runs are distributed: the share of all runs whose error is at most so large.

const DISTRIBUTION_COLOURS = 8, DISTRIBUTION_DASHES = ["", "7 4", "2 3"];
const lineStyle = (i) => ({ class: `curve c${i % DISTRIBUTION_COLOURS}`, "stroke-dasharray": DISTRIBUTION_DASHES[Math.floor(i / DISTRIBUTION_COLOURS) % DISTRIBUTION_DASHES.length] || undefined });
const percent = (share) => `${Number((100 * share).toPrecision(3))} %`;

// Of {ok, runs, errors} (report_data.hpp): the least error that `share` of the runs that ended well do not exceed, as near as the numbers tell.
const quantileOf = ({ errors }, share) => errors[Math.max(0, Math.ceil(share * errors.length) - 1)];

// Points [error, share] of the curve. All errors: a stair, which rises at each. Quantiles: a line through them.
function distributionPoints({ ok, runs, errors }) {
  if (errors.length < ok) return errors.map((error, k) => [error, ((k / (errors.length - 1)) * ok) / runs]);
  return errors.flatMap((error, i) => [[error, i / runs], [error, (i + 1) / runs]]);
}

function distributionChart(variants, system) {
  const said = variants.map(({ variant, distribution: d }) => `${variant}: half of the runs that ended well at most ${shortNumber(quantileOf(d, 0.5))} ${system.unit}, 95 % ${shortNumber(quantileOf(d, 0.95))}, largest ${shortNumber(d.errors.at(-1))}`);
  const chart = new Chart(760, 300, `Distribution of the ${system.label} over runs. ${said.join("; ")}`);
  const { left, right, top, bottom } = chart.box;
  chart.add("text", { class: "title", x: left, y: 12 }, `Share of runs whose ${system.label} is at most so large`);
  const most = Math.max(...variants.map(({ distribution: { errors } }) => errors.at(-1)));
  const least = Math.max(Math.min(...variants.map(({ distribution: { errors } }) => errors[0])), most / 1e6);
  const low = least / 1.05, high = most * 1.05;
  const x = chart.scale(left, right, low, high, true), y = chart.scale(bottom, top, 0, 1);
  const powers = logTicks(low, high), ticks = powers.length > 2 ? powers : roundTicks(low, high, 6);
  chart.xAxis(x, ticks, `${inBrackets(system)}, log scale`);
  chart.yAxis(y, [0, 0.25, 0.5, 0.75, 1], "share of runs", percent);
  variants.forEach(({ variant, distribution }, i) => {
    const points = distributionPoints(distribution).map(([error, share]) => `${x(Math.max(error, low)).toFixed(1)} ${y(share).toFixed(1)}`);
    chart.add("path", { ...lineStyle(i), d: `M${points.join("L")}H${right}` }).append(svgElement("title", {}, said[i]));
  });
  return chart.svg;
}

// A line a curve, in the order of the curves.
function curveLegend(texts) {
  return element("ul", { class: "legend" }, ...texts.map((text, i) => {
    const line = svgElement("svg", { width: 26, height: 8, viewBox: "0 0 26 8", "aria-hidden": "true" });
    line.append(svgElement("line", { ...lineStyle(i), x1: 0, x2: 26, y1: 4, y2: 4 }));
    return element("li", {}, line, ` ${text}`);
  }));
}

function distributionLegend(variants, system) {
  return curveLegend(variants.map(({ variant, distribution: d }) => {
    const ended = d.ok === d.runs ? `${d.runs.toLocaleString("en")} runs` : `${d.ok.toLocaleString("en")} of ${d.runs.toLocaleString("en")} runs ended well`;
    return `${variant}: half up to ${shortNumber(quantileOf(d, 0.5))}, 95 % up to ${shortNumber(quantileOf(d, 0.95))} ${system.unit}, ${ended}`;
  }));
}

// Best variant first, as they are ranked; nothing of variants with few runs.
function drawDistribution(place, ranking, system) {
  const variants = ranking.variants.filter(({ distribution }) => distribution);
  place.hidden = !variants.length;
  place.replaceChildren(...(variants.length ? [distributionChart(variants, system), distributionLegend(variants, system)] : []));
}
