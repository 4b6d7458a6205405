// Pictures made of pixels: eigenimages, recovered views, distance and profile matrices, localization matrices.

function drawEigenimages(cell) {
  const { uri, count } = cell.eigenimages;
  const rows = Math.ceil(count / 5);
  const labels = Array.from({ length: count }, (_, i) => svg("text", { class: "on-tile", x: (i % 5) * 10 + 0.6, y: Math.floor(i / 5) * 10 + 2.6 }, i + 1));
  return svg("svg", { class: "sprite", viewBox: `0 0 50 ${10 * rows}`, role: "img", "aria-label": `The first ${count} eigenimages` },
    svg("image", { href: uri, width: 50, height: 10 * rows }), ...labels);
}

function drawRecovered(cell) {
  const { uri, views, dims } = cell.recovered;
  const across = (i) => 13 + 10 * i;
  const down = (i) => 5 + 10 * i;
  const columns = views.map((view, i) => svg("text", { class: "tile-label", x: across(i) + 5, y: 3.4, "text-anchor": "middle", "data-view": view }, view));
  const rows = dims.map((k, i) => svg("text", { class: "tile-label", x: 12, y: down(i) + 6, "text-anchor": "end" }, k === 0 ? "view" : `k = ${k}`));
  const label = `Views ${views.join(", ")} recovered from ${dims.slice(1).join(", ")} dimensions`;
  return svg("svg", { class: "sprite", viewBox: `0 0 ${across(views.length)} ${down(dims.length)}`, role: "img", "aria-label": label },
    svg("image", { href: uri, x: across(0), y: down(0), width: 10 * views.length, height: 10 * dims.length }), ...columns, ...rows);
}

// Shares of white, row after row, as a canvas with one pixel each.
function grayCanvas(shares, width, height, label) {
  const canvas = html("canvas", { width, height, role: "img", "aria-label": label });
  const context = canvas.getContext("2d");
  const pixels = context.createImageData(width, height);
  // A pixel is four equal bytes but for the last, opacity.
  const whole = new Uint32Array(pixels.data.buffer);
  for (let i = 0; i < shares.length; i++) whole[i] = 0xff000000 | (Math.round(255 * shares[i]) * 0x010101);
  context.putImageData(pixels, 0, 0);
  return canvas;
}

// Columns (and rows) of a matrix that are marked with their view.
function matrixMarks(columns, rows, className, marks) {
  return svg("svg", { class: className, viewBox: `0 0 ${columns} ${rows}`, preserveAspectRatio: "none", "aria-hidden": "true" }, ...marks);
}

const columnMark = (i, height) => svg("rect", { class: "stripe", x: i, y: 0, width: 1, height, "data-view": i + 1 });
const rowMark = (i, width) => svg("rect", { class: "stripe", x: 0, y: i, width, height: 1, "data-view": i + 1 });

function drawDistances(cell) {
  const n = data.views.length;
  const matrix = distances(cell, chosenDims());
  const [mean, spread] = meanAndSpread(matrix);
  const canvas = grayCanvas(matrix, n, n, `Distance matrix of ${n} views in ${chosenDims()} dimensions`);
  const stripes = viewNumbers.map((view) => rowMark(view - 1, n));
  const box = html("div", { class: "matrix", ...walkable, "aria-label": "Distance matrix; arrow keys walk through the views" }, canvas, matrixMarks(n, n, "marks", stripes));
  const pair = document.getElementById("pair");
  pair.textContent = "Point at the matrix for a pair of views.";
  const follow = (event) => {
    const area = canvas.getBoundingClientRect();
    const at = (offset, side) => Math.max(0, Math.min(n - 1, Math.floor((offset / side) * n)));
    const j = at(event.clientX - area.left, area.width);
    const i = at(event.clientY - area.top, area.height);
    pair.textContent = `Views ${i + 1} and ${j + 1}: nSSD ${matrix[i * n + j].toFixed(3)}`;
  };
  box.addEventListener("pointermove", follow);
  box.addEventListener("pointerdown", follow);
  return [box, grayScale("identical", "1"), html("p", { class: "facts" }, `Mean ${mean.toFixed(3)}, spread ${spread.toFixed(3)} (standard deviation) over all pairs in ${chosenDims()} dimensions`)];
}

function grayScale(black, white) {
  return html("p", { class: "gray-scale" }, black, html("span", { "aria-hidden": "true" }), white);
}

function drawDistancesStrip(cell) {
  const n = data.views.length;
  return html("div", { class: "strip" }, ...cell.dims.map((k) => {
    const button = html("button", { type: "button", "aria-pressed": String(k === chosenDims()), "aria-label": `${k} dimensions` },
      remember(cell, `small ${k}`, () => grayCanvas(distances(cell, k), n, n, "")), html("span", {}, `k = ${k}`));
    button.addEventListener("click", () => change({ dims: k }));
    return button;
  }));
}

function stretched(values) {
  const least = Math.min(...values);
  const most = Math.max(...values);
  return Array.from(values, (value) => (most > least ? (value - least) / (most - least) : 0));
}

function drawProfiles(cell) {
  const n = data.views.length;
  const rows = cell.dims.length;
  const shares = cell.dims.flatMap((k) => stretched(profile(cell, k)));
  const canvas = grayCanvas(shares, n, rows, `Profile matrix: ${rows} numbers of dimensions by ${n} views`);
  const now = svg("rect", { class: "row-now", x: 0, y: chosenIndex(), width: n, height: 1 });
  const stripes = viewNumbers.map((view) => columnMark(view - 1, rows));
  const labels = html("ol", { class: "rows", "aria-hidden": "true" }, ...cell.dims.map((k, i) => html("li", { class: i === chosenIndex() ? "now" : null }, k)));
  const box = html("div", { class: "matrix wide", ...walkable, "aria-label": "Profile matrix; arrow keys walk through the views" }, canvas, matrixMarks(n, rows, "marks", [now, ...stripes]));
  return [html("div", { class: "profile-matrix" }, labels, box), grayScale("most similar", "most dissimilar")];
}

function drawSortedProfiles(cell) {
  const shown = [...new Set([1, 3, 7, 15, 35, cell.dims.at(-1)].map((k) => nearestDims(cell.dims, k)).concat(chosenIndex()))].sort((a, b) => a - b);
  const curves = shown.map((i, nth) => ({
    name: `${cell.dims[i]}`,
    ...look(nth, shown.length),
    strong: i === chosenIndex(),
    points: [...profile(cell, cell.dims[i])].sort((a, b) => b - a).map((value, rank) => [rank + 1, value]),
  }));
  const plot = linePlot({ title: "Profiles, sorted, by dimensions", x: { label: "rank", unit: "(rank)" }, y: { label: "mean dissimilarity" }, curves });
  return html("div", {}, ...plot, legend(curves));
}

function drawLocalization(cell) {
  const shown = cell.localization.filter(({ landmark }) => landmark === state.landmark);
  return shown.length ? shown.map(localizationPicture) : null;
}

function localizationPicture({ dims, landmark, uri, least, most, minima, peaks, elsewhere }) {
  const picture = svg("image", { href: uri, width: mapWidth, height: mapHeight, preserveAspectRatio: "none" });
  const dots = peaks.map(([x, y], i) => svg("circle", { cx: x, cy: y, r: 22 - (12 * i) / peaks.length, class: "peak", style: `fill:hsl(${225 - (215 * i) / peaks.length} 85% 60%)` }));
  const label = `Localization matrix of view ${landmark} in ${dims} dimensions, ${minima} local minima`;
  const box = svg("svg", { class: "localization", viewBox: `0 0 ${mapWidth} ${mapHeight}`, role: "img", "aria-label": label },
    picture, frame(landmark, "landmark"), ...[...dots].reverse(), ...peakNumbers(peaks));
  const turned = elsewhere === null ? "" : ` For ${percent(elsewhere)} of turned views the global minimum is elsewhere.`;
  return html("div", {}, box, html("p", {}, html("b", {}, `${dims} dimensions, view ${landmark}.`),
    ` ${minima} local minima; black is ${words(least)}, white is ${words(most)}.${turned}`));
}

// Numbers that would lie over earlier ones are left out; their dots stay.
function peakNumbers(peaks) {
  const placed = [];
  const apart = { x: 100, y: 80 };
  return peaks.flatMap(([x, y], i) => {
    const at = [Math.min(Math.max(x, 40), mapWidth - 40), y < 110 ? y + 62 : y - 58];
    if (placed.some(([px, py]) => Math.abs(px - at[0]) < apart.x && Math.abs(py - at[1]) < apart.y)) return [];
    placed.push(at);
    return [mapText(at, i + 1)];
  });
}
