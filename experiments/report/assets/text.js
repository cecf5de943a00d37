// Small helpers: elements, numbers for a person.

const byId = (id) => document.getElementById(id);

// An element with attributes and children; text is text, never markup.
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key === "onclick") made.addEventListener("click", value);
    else if (value !== undefined && value !== null && value !== false) made.setAttribute(key, value);
  }
  made.append(...children.filter((child) => child !== undefined && child !== null));
  return made;
}

function svgElement(name, attributes = {}, text) {
  const made = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

// Three significant digits, no exponent between 0.001 and a million: as the program's own tables.
function shortNumber(value) {
  if (value === undefined || value === null || Number.isNaN(value)) return "-";
  if (value === 0 || !Number.isFinite(value)) return String(value);
  const magnitude = Math.abs(value);
  if (magnitude < 1e-3 || magnitude >= 1e6) return value.toExponential(2);
  const digits = Math.min(5, Math.max(0, 2 - Math.floor(Math.log10(magnitude))));
  return value.toFixed(digits).replace("-", "\u2212");
}

const fixed = (value, digits) =>
  value === null || value === undefined || Number.isNaN(value) ? "-" : value.toFixed(digits).replace("-", "\u2212");

const capital = (text) => text.charAt(0).toUpperCase() + text.slice(1);

// "a", "a and b", "a, b and c".
const enumeration = (words) => words.join(", ").replace(/, ([^,]*)$/, " and $1");

// How long something took, for a person. A sum of floating point may end in nines: twelve digits are true.
function duration(us) {
  const short = (value) => Number(value.toPrecision(12));
  return us >= 1e6 ? `${short(us / 1e6)} s` : us >= 1e3 ? `${short(us / 1e3)} ms` : `${short(us)} \u00b5s`;
}

// Decimals that tell multiples of `step` apart.
function decimalsOf(step) {
  let decimals = 0;
  while (decimals < 12 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6 * step * 10 ** decimals) ++decimals;
  return decimals;
}

const plural = (count, word) => `${count.toLocaleString("en")} ${word}${count === 1 ? "" : "s"}`;

// A colour of the style sheet in force.
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue("--" + name).trim();

// Replaces the choices of a <select>, keeping the one that is chosen if it is still there.
function setOptions(select, options) {
  const chosen = select.value;
  select.replaceChildren(...options.map(([value, label]) => element("option", { value }, label)));
  if (options.some(([value]) => value === chosen)) select.value = chosen;
}
