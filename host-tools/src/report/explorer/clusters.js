// Clusters: dendrogram, scatter plot, silhouettes, and the clusters on the map.

const linkageNames = ["single", "complete", "average", "centroid"];

const linkageHere = (cell) => cell.clusters?.linkages[state.linkage]?.[nearestDims(cell.dims, state.dims)];
const meansHere = (cell) => cell.clusters?.kmeans[nearestDims(cell.dims, state.dims)];

// Cluster of every view, by what the pictures are colored with; null where that was not computed.
function clusterOfViews(cell) {
  if (state.by === "k-means") {
    const cut = meansHere(cell)?.cuts[state.cut];
    return cut ? [...numbers(cut, "of", Uint8Array)] : null;
  }
  const linkage = linkageHere(cell);
  return linkage ? cutMerges(mergesOf(linkage), state.clusters).slice(0, data.views.length) : null;
}

function drawDendrogram(cell) {
  const linkage = linkageHere(cell);
  if (!linkage) return null;
  const merges = mergesOf(linkage);
  const n = merges.length + 1;
  const box = { left: 44, top: 14, step: 12, height: 260 };
  const width = box.left + n * box.step;
  const top = Math.max(...merges.map(({ height }) => height)) * 1.04 || 1;
  const y = (height) => box.top + box.height * (1 - height / top);
  const ids = cutMerges(merges, state.clusters);
  const order = leafOrder(merges, n);
  const nodes = new Array(2 * n - 1);
  order.forEach((leaf, i) => (nodes[leaf] = { x: box.left + (i + 0.5) * box.step, y: y(0) }));
  const branches = merges.map(({ a, b, height }, i) => {
    const at = y(height);
    nodes[n + i] = { x: (nodes[a].x + nodes[b].x) / 2, y: at };
    const id = ids[n + i];
    return svg("path", { class: "branch", style: id === null ? null : `stroke:${clusterColor(id)}`, d: `M${nodes[a].x} ${nodes[a].y}V${at}H${nodes[b].x}V${nodes[b].y}` });
  });
  const leaves = order.map((leaf) => svg("text", { class: "leaf", transform: `translate(${nodes[leaf].x + 3} ${y(0) + 5}) rotate(-90)`, "text-anchor": "end", "data-view": leaf + 1 }, leaf + 1));
  const label = `Dendrogram, ${state.linkage} linkage, cut into ${state.clusters} clusters`;
  const drawing = svg("svg", { class: "dendrogram", viewBox: `0 0 ${width} ${box.top + box.height + 26}`, role: "img", "aria-label": label },
    ...heightAxis(top, y, box.left, width), ...branches, cutLine(merges, y, box.left, width), ...leaves);
  return [html("p", { class: "facts" }, `CCC ${linkage.ccc?.toFixed(3) ?? "undefined"} with ${state.linkage} linkage in ${chosenDims()} dimensions`), drawing];
}

function heightAxis(top, y, left, right) {
  return ticks(0, top, 5).flatMap((tick) => [
    svg("line", { class: "grid", x1: left, x2: right, y1: y(tick), y2: y(tick) }),
    svg("text", { class: "tick", x: left - 5, y: y(tick) + 4, "text-anchor": "end" }, words(tick, 6)),
  ]);
}

// Between the last merge below the cut and the first above it.
function cutLine(merges, y, left, right) {
  const below = merges[merges.length - state.clusters]?.height ?? 0;
  const above = merges[merges.length - state.clusters + 1]?.height ?? below * 1.03;
  const at = y((below + above) / 2);
  return svg("line", { class: "cut", x1: left, x2: right, y1: at, y2: at });
}

// Shapes as well as colors tell neighboring numbers apart.
const shapes = [
  "M-4 0A4 4 0 1 0 4 0A4 4 0 1 0 -4 0Z",
  "M-3.7 -3.7H3.7V3.7H-3.7Z",
  "M0 -5L4.6 3.6H-4.6Z",
  "M0 -5.2L5.2 0L0 5.2L-5.2 0Z",
  "M0 5L4.6 -3.6H-4.6Z",
];

function drawScatter(cell) {
  const points = numbers(cell, "coordinates", Float32Array);
  const width = points.length / data.views.length;
  const coordinate = (view, d) => (d < width ? points[(view - 1) * width + d] : 0);
  const places = viewNumbers.map((view) => [coordinate(view, 0), coordinate(view, 1)]);
  const clusters = clusterOfViews(cell);
  if (!clusters) return null;
  const axes = {
    x: axis({ range: spanOf(places, 0), count: 5 }, [], 0, plotBox.left, plotBox.width - plotBox.right),
    y: axis({ range: spanOf(places, 1) }, [], 1, plotBox.height - plotBox.bottom, plotBox.top),
  };
  const dots = viewNumbers.map((view, i) => svg("path", {
    class: "dot", d: shapes[clusters[i] % shapes.length], style: `fill:${clusterColor(clusters[i])}`,
    transform: `translate(${axes.x.place(places[i][0])} ${axes.y.place(places[i][1])})`, "data-view": view,
  }, svg("title", {}, `view ${view}, cluster ${clusters[i] + 1}`)));
  return svg("svg", { class: "plot", viewBox: `0 0 ${plotBox.width} ${plotBox.height}`, role: "img", "aria-label": "Views by their first two coordinates, marked by cluster" },
    svg("text", { class: "title", x: plotBox.left, y: 17 }, clusterSource()), ...gridLines(axes), ...axisLabels({ label: "first coordinate" }, { label: "second coordinate" }), ...dots);
}

const clusterSource = () => (state.by === "k-means" ? `k-means, ${state.cut} clusters` : `${state.linkage} linkage, ${state.clusters} clusters`);

function spanOf(places, which) {
  const values = places.map((place) => place[which]);
  const [least, most] = [Math.min(...values), Math.max(...values)];
  const room = 0.06 * (most - least) || 1;
  return [least - room, most + room];
}

function drawSilhouettes(cell) {
  const cut = meansHere(cell)?.cuts[state.cut];
  if (!cut) return null;
  const clusters = numbers(cut, "of", Uint8Array);
  const values = numbers(cut, "silhouette", Int8Array);
  const groups = Array.from({ length: Math.max(...clusters) + 1 }, (_, id) =>
    viewNumbers.filter((view) => clusters[view - 1] === id).sort((a, b) => values[b - 1] - values[a - 1]));
  const gap = 6;
  const bar = 4;
  const height = groups.reduce((total, group) => total + Math.max(bar * group.length, 11) + gap, 24);
  const x = axis({ range: [-1, 1], count: 4 }, [], 0, 40, plotBox.width - plotBox.right);
  const drawn = [];
  let y = 4;
  groups.forEach((group, id) => {
    const size = Math.max(bar * group.length, 11);
    drawn.push(svg("text", { class: "tick", x: 32, y: y + size / 2 + 4, "text-anchor": "end" }, id + 1));
    group.forEach((view, i) => drawn.push(silhouetteBar(view, id, values[view - 1] / 127, x, y + bar * i, bar)));
    y += size + gap;
  });
  const grid = x.ticks.flatMap((tick) => [
    svg("line", { class: tick === 0 ? "frame" : "grid", x1: x.place(tick), x2: x.place(tick), y1: 0, y2: height - 18 }),
    svg("text", { class: "tick", x: x.place(tick), y: height - 4, "text-anchor": tick === 1 ? "end" : "middle" }, words(tick)),
  ]);
  return svg("svg", { class: "plot silhouettes", viewBox: `0 0 ${plotBox.width} ${height}`, role: "img", "aria-label": `Silhouettes of ${groups.length} k-means clusters` }, ...grid, ...drawn);
}

function silhouetteBar(view, id, value, x, y, height) {
  const [from, to] = [Math.min(0, value), Math.max(0, value)];
  return svg("rect", { class: "bar-of", x: x.place(from), y, width: Math.max(1, x.place(to) - x.place(from)), height: height - 0.8, style: `fill:${clusterColor(id)}`, "data-view": view },
    svg("title", {}, `view ${view}, cluster ${id + 1}: ${words(value, 2)}`));
}

function drawSilhouetteCurves(cell) {
  const means = meansHere(cell);
  if (!means) return null;
  const rows = numbers(means, "curve", Float32Array);
  const names = ["mean", "median", "share of negative ones"];
  const curves = names.map((name, column) => ({
    name, ...look(column, names.length), points: Array.from({ length: rows.length / 3 }, (_, i) => [i + 1, rows[3 * i + column]]),
  }));
  const plot = linePlot({ title: `Silhouettes in ${chosenDims()} dimensions`, x: { label: "number of clusters", unit: "clusters" }, y: { label: "silhouette, share" }, curves, at: Number(state.cut) });
  return html("div", {}, ...plot, legend(curves));
}

function drawClustersOnMap(cell) {
  const clusters = clusterOfViews(cell);
  if (!clusters) return null;
  const side = 0.55 * spacing;
  const alone = Number(state.alone);
  const shown = viewNumbers.filter((view) => !alone || clusters[view - 1] === alone - 1);
  const marks = shown.flatMap((view) => {
    const [x, y] = data.views[view - 1];
    const id = clusters[view - 1];
    const box = svg("rect", { class: "patch", x: x - side / 2, y: y - side / 2, width: side, height: side, rx: side / 8, style: `fill:${clusterColor(id)}`, "data-view": view });
    return [alone ? frame(view, "landmark") : null, box, mapText([x, y], id + 1, { "data-view": view })];
  });
  return mapDrawing(`Map with ${alone ? `the ${shown.length} views of cluster ${alone}` : "every view's cluster"}: ${clusterSource()}`, marks.filter(Boolean), walkable);
}

const cutsOffered = () => Object.keys(data.cells.find((cell) => cell.clusters)?.clusters.kmeans.find(Boolean)?.cuts ?? {});

function clustersOffered() {
  const count = state.by === "k-means" ? Number(state.cut) : state.clusters;
  return [["0", "all"], ...Array.from({ length: count }, (_, i) => [String(i + 1), String(i + 1)])];
}
