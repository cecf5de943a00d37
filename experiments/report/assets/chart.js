// Drawings of points and bars, as SVG: sharp on paper, their text is text.

// Round numbers that divide [low, high] into a few parts.
function roundTicks(low, high, most) {
  const least = (high - low) / most, power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((candidate) => candidate >= least * 0.999);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; ++i) ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

// 1, 2, 5 times powers of ten in [low, high]; thinned to powers of ten over a wide range.
function logTicks(low, high) {
  const ticks = [], wide = high / low > 300;
  for (let power = Math.floor(Math.log10(low)); power <= Math.ceil(Math.log10(high)); ++power)
    for (const digit of wide ? [1] : [1, 2, 5]) {
      const tick = Number((digit * 10 ** power).toPrecision(3));
      if (tick >= low * 0.999 && tick <= high * 1.001) ticks.push(tick);
    }
  return ticks;
}

class Chart {
  constructor(width, height, label) {
    this.width = width;
    this.height = height;
    this.box = { left: 52, right: width - 8, top: 22, bottom: height - 38 };
    this.svg = svgElement("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
  }
  add(name, attributes, text) {
    const made = svgElement(name, attributes, text);
    this.svg.append(made);
    return made;
  }
  scale(from, to, low, high, log) {
    const map = log ? Math.log10 : (x) => x;
    return (x) => from + ((map(x) - map(low)) / (map(high) - map(low))) * (to - from);
  }
  xAxis(scale, ticks, label, text = String) {
    const { left, right, top, bottom } = this.box;
    for (const tick of ticks) {
      this.add("line", { class: "grid", x1: scale(tick), x2: scale(tick), y1: top, y2: bottom });
      this.add("text", { class: "quiet", x: scale(tick), y: bottom + 14, "text-anchor": "middle" }, text(tick));
    }
    this.add("line", { class: "axis", x1: left, x2: right, y1: bottom, y2: bottom });
    this.add("text", { x: (left + right) / 2, y: bottom + 30, "text-anchor": "middle" }, label);
  }
  yAxis(scale, ticks, label, text = String) {
    const { left, right, top, bottom } = this.box;
    for (const tick of ticks) {
      this.add("line", { class: "grid", x1: left, x2: right, y1: scale(tick), y2: scale(tick) });
      this.add("text", { class: "quiet", x: left - 5, y: scale(tick) + 4, "text-anchor": "end" }, text(tick));
    }
    this.add("line", { class: "axis", x1: left, x2: left, y1: top, y2: bottom });
    const middle = (top + bottom) / 2;
    this.add("text", { x: 11, y: middle, "text-anchor": "middle", transform: `rotate(-90 11 ${middle})` }, label);
  }
}

const MANY_SCENARIOS = 20;  // from which on percentiles and intervals say something

const overlap = (a, b) => a.x < b.x + b.w && b.x < a.x + a.w && a.y < b.y + b.h && b.y < a.y + a.h;

// Names beside their points: the nearest place where they cover nothing.
function placeLabels(chart, points) {
  const taken = points.map((p) => ({ x: p.x - 4, y: p.y - 4, w: 8, h: 8 }));
  const { left, right, top, bottom } = chart.box;
  for (const point of points) {
    const w = 6.1 * point.name.length + 2, h = 12;
    const places = [];
    for (const distance of [6, 14, 24, 36, 50])
      for (const [dx, dy] of [[1, 0], [1, -1], [1, 1], [-1, 0], [-1, -1], [-1, 1], [0, -1], [0, 1]])
        places.push({ x: point.x + dx * distance - (dx < 0 ? w : dx === 0 ? w / 2 : 0), y: point.y - h / 2 + dy * distance, w, h, distance });
    const inside = (box) => box.x > left && box.x + w < right + 6 && box.y > top - 6 && box.y + h < bottom;
    const place = places.find((box) => inside(box) && !taken.some((other) => overlap(box, other)));
    if (!place) continue;  // the point still tells its name
    taken.push(place);
    if (place.distance > 6) {
      const nearX = Math.min(Math.max(point.x, place.x), place.x + w), nearY = Math.min(Math.max(point.y, place.y), place.y + h);
      chart.add("line", { class: "leader", x1: point.x, y1: point.y, x2: nearX, y2: nearY });
    }
    chart.add("text", { x: place.x, y: place.y + 10 }, point.name);
  }
}

const inBrackets = ({ label, unit }) => (unit ? `${label} [${unit}]` : label);

// The ranked variants as points, their error against one of the efforts, with the front that no variant is better than in both.
function paretoChart(variants, system, effort, intervals) {
  const error = (v) => v[system.judged], cost = (v) => v[effort.key];
  const title = `Error against ${effort.label}`;
  const chart = new Chart(430, 240, `${title}: ${variants.map((v) => `${v.variant} ${shortNumber(error(v))} ${system.unit} at ${shortNumber(cost(v))}`).join("; ")}`);
  const { left, right, top, bottom } = chart.box;
  chart.add("text", { class: "title", x: left, y: 12 }, title);
  const margin = (v) => (intervals ? v[system.margin] : 1);
  const lows = variants.map((v) => error(v) / margin(v)), highs = variants.map((v) => error(v) * margin(v));
  const low = 0.8 * Math.min(...lows), high = 1.25 * Math.max(...highs);
  const most = 1.12 * Math.max(...variants.map(cost), 1e-9);
  const x = chart.scale(left, right, 0, most), y = chart.scale(bottom, top, low, high, true);
  chart.xAxis(x, roundTicks(0, most, 6), inBrackets(effort));
  chart.yAxis(y, logTicks(low, high), `${inBrackets(system)}, log scale`);
  const sorted = [...variants].sort((a, b) => cost(a) - cost(b));
  let best = Infinity, path = "";
  for (const v of sorted) {
    if (error(v) >= best) continue;
    path += path ? `H${x(cost(v))}V${y(error(v))}` : `M${x(cost(v))} ${y(error(v))}`;
    best = error(v);
  }
  chart.add("path", { class: "front", d: path + `H${right}` });
  const points = sorted.map((v) => ({ name: v.variant, x: x(cost(v)), y: y(error(v)), v }));
  for (const { x: px, y: py, v } of points) {
    if (margin(v) > 1) chart.add("line", { class: "margin", x1: px, x2: px, y1: y(error(v) / margin(v)), y2: y(error(v) * margin(v)) });
    chart.add("circle", { class: "point", cx: px, cy: py, r: 4 }).append(
      svgElement("title", {}, `${v.variant}: ${system.label} ${shortNumber(error(v))} ${system.unit}, ${inBrackets(effort)} ${shortNumber(cost(v))}`));
  }
  placeLabels(chart, points);
  return chart.svg;
}

function drawPareto(place, ranking, system) {
  const ranked = ranking.variants.filter((v) => v.ranked && v[system.judged] > 0);
  place.replaceChildren(...(ranked.length ? system.efforts.map((effort) => paretoChart(ranked, system, effort, ranking.common >= MANY_SCENARIOS)) : []));
}
