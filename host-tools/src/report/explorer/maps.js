// Pictures over the map: frames of views, landmarks, start lists.

const { width: mapWidth, height: mapHeight, view_px: footprint } = data.map;

// Least distance between the centers of two candidates: what is drawn at them must be smaller.
const spacing = nearestCenters(data.views);

function nearestCenters(places) {
  let least = footprint;
  for (let a = 0; a < places.length; a++) {
    for (let b = 0; b < a; b++) least = Math.min(least, Math.hypot(places[a][0] - places[b][0], places[a][1] - places[b][1]));
  }
  return least;
}

// The map itself is one rule of style: a hundred drawings over it share one decoded picture.
function showMap() {
  document.head.append(html("style", {}, `.aerial{background-image:url("${data.map.picture}")}`));
}

function mapDrawing(label, children, attributes = {}) {
  return svg("svg", { class: "aerial", viewBox: `0 0 ${mapWidth} ${mapHeight}`, role: "img", "aria-label": label, ...attributes }, ...children);
}

const walkable = { tabindex: 0, "data-walk": "", role: "group" };

function frame(view, className) {
  const [x, y] = data.views[view - 1];
  return svg("rect", { class: className, x: x - footprint / 2, y: y - footprint / 2, width: footprint, height: footprint, "data-view": view });
}

function mapText([x, y], text, attributes = {}) {
  return svg("text", { class: "on-map", x, y, dy: "0.35em", "text-anchor": "middle", ...attributes }, String(text));
}

function inLattice(view) {
  const [first] = data.lattices;
  return state.lattice === "all" || (state.lattice === "first") === (view <= first);
}

// Beyond this many candidates numbers would hide the map.
const numbersUpTo = 400;

function drawViews() {
  const shown = viewNumbers.filter(inLattice);
  const frames = shown.map((view) => frame(view, view <= data.lattices[0] ? "view" : "view second"));
  const labels = shown.length > numbersUpTo ? [] : shown.map((view) => mapText(data.views[view - 1], view, { "data-view": view }));
  return mapDrawing(`Map with the frames of ${shown.length} views`, [...frames, ...labels], walkable);
}

// Frames with a rank each; ranks of views that overlap stand apart because their centers do.
function landmarkDrawing(landmarks, label, attributes) {
  const frames = landmarks.map((view) => frame(view, "landmark"));
  const ranks = landmarks.map((view, i) => mapText(data.views[view - 1], i + 1, { class: "on-map rank", "data-view": view }));
  return mapDrawing(label, [...frames, ...ranks], attributes);
}

const chosenTable = (cell) => cell.tables[state.method];

function drawLandmarks(cell) {
  const entry = chosenTable(cell)?.[chosenIndex()];
  if (!entry) return null;
  const label = `Map with the landmarks, best first: ${entry.landmarks.join(", ")}`;
  return landmarkDrawing(entry.landmarks, label, walkable);
}

function drawSelections(cell) {
  const table = chosenTable(cell);
  if (!table) return null;
  const most = Math.max(...table.map((entry) => entry?.landmarks.length ?? 0));
  const ranks = Array.from({ length: most }, (_, i) => html("th", { scope: "col" }, i + 1));
  const head = html("tr", {}, html("th", { scope: "col" }, "dimensions"), ...ranks);
  const rows = table.map((entry, i) => {
    const now = i === chosenIndex();
    const cells = entry
      ? entry.landmarks.map((view) => html("td", { "data-view": view }, view))
      : [html("td", { colspan: most, class: "absent" }, "not measured")];
    return html("tr", { class: now ? "now" : null, "aria-current": now ? "true" : null }, html("th", { scope: "row" }, `${now ? "▸ " : ""}${cell.dims[i]}`), ...cells);
  });
  return html("div", { class: "scroll", tabindex: 0 }, html("table", { class: "selections" }, html("caption", { class: "unseen" }, "View numbers by rank"), head, ...rows));
}

function drawStarts() {
  return data.starts.map(({ id, views, about }) =>
    html("div", { class: "start" },
      mapDrawing(`Start list ${id}: views ${views.join(", ")}`, views.map((view) => frame(view, "landmark"))),
      html("p", {}, html("b", {}, id), ` ${views.join(", ")}`, html("br", {}), about)));
}
