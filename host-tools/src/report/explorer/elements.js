// Elements, colors and texts that every picture is made of.

const svgNames = "http://www.w3.org/2000/svg";

function html(name, attributes, ...children) {
  return fill(document.createElement(name), attributes, children);
}

function svg(name, attributes, ...children) {
  return fill(document.createElementNS(svgNames, name), attributes, children);
}

function fill(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
}

// A number without digits that say nothing, with a real minus sign.
const words = (value, digits = 3) => String(Number(value.toPrecision(digits))).replace("-", "−");
const percent = (share, digits = 3) => `${words(100 * share, digits)} %`;

// How one of `count` is drawn: color and dashes both tell curves apart. Ordered things (blurs, scales) go from blue over
// green and orange to red, as in the 2004 report; unordered ones (methods) get hues far from each other.
const dashes = [null, "7 3", "2 3", "9 3 2 3", "12 4", "4 2 1 2"];
const hues = [218, 160, 32, -12];
function look(i, count, ordered = true) {
  const step = count > 1 ? (i / (count - 1)) * (hues.length - 1) : 0;
  const [from, to] = [hues[Math.floor(step)], hues[Math.ceil(step)]];
  const hue = ordered ? from + (step % 1) * (to - from) : i * 137.5;
  return { color: `hsl(${Math.round((hue + 360) % 360)} var(--curve))`, dash: dashes[i % dashes.length] };
}

// Neighboring numbers of clusters get colors far from each other.
const clusterColor = (i) => `hsl(${Math.round((i * 137.5) % 360)} ${i % 2 ? "var(--curve)" : "var(--curve-strong)"})`;

function lineSample({ color, dash }) {
  return svg("svg", { class: "sample", viewBox: "0 0 34 10", "aria-hidden": "true" },
    svg("line", { x1: 1, x2: 33, y1: 5, y2: 5, stroke: color, "stroke-dasharray": dash, "stroke-width": 2.5 }));
}

function legend(entries) {
  return html("div", { class: "legend" }, ...entries.map(({ name, strong, ...look }) =>
    html("span", { class: strong ? "strong" : null }, lineSample(look), name)));
}

// Round ticks (1, 2 or 5 times a power of ten), about `count` of them.
function ticks(from, to, count) {
  const rough = (to - from) / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * ([1, 2, 5].find((factor) => factor * power >= rough * 0.999) ?? 10);
  const first = Math.ceil(from / step - 1e-9);
  const last = Math.floor(to / step + 1e-9);
  return Array.from({ length: last - first + 1 }, (_, i) => (first + i) * step);
}

function logTicks(from, to) {
  const found = [];
  for (let power = Math.floor(Math.log10(from)); power <= Math.log10(to); power++) {
    for (const factor of to / from > 300 ? [1] : [1, 2, 5]) found.push(factor * 10 ** power);
  }
  return found.filter((tick) => tick >= from * 0.999 && tick <= to * 1.001);
}
