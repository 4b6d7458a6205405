// How far views may deviate from landmarks, against dimensions or scale, for blurs or methods.

// Where the pairs of limits stand in a row of seven numbers; one number only is a curve, not a pair.
const deviations = [
  { id: "orientation", title: "Orientation", y: { label: "degrees", unit: "°" }, at: [0, 1] },
  { id: "altitude", title: "Altitude", y: { label: "altitude ratio" }, at: [2, 3] },
  { id: "catchment", title: "Catchment area", y: { label: "% of the map", unit: " %" }, at: [6] },
  { id: "gamma", title: "Image brightness", y: { label: "gamma", log: true }, at: [4, 5] },
];

// The series that are compared: which blur and method each stands for.
function comparedSeries() {
  if (state.compare === "methods") {
    return data.methods.map(({ id, name }, i) => ({
      name, blur: state.blur, method: id, ...look(i, data.methods.length, false), strong: id === state.method,
    }));
  }
  return data.blurs.map((blur) => ({ ...blurLook(blur), blur, method: state.method }));
}

// [x, seven numbers or null] of one series, at every number of dimensions or at every scale.
function limitsOf({ blur, method }) {
  const entryOf = (cell, i) => cell?.tables[method]?.[i]?.[state.criterion] ?? null;
  if (state.against === "scale") {
    return data.scales.map((scale) => {
      const cell = cellOf(scale, blur);
      return [scale, cell ? entryOf(cell, nearestDims(cell.dims, state.dims)) : null];
    });
  }
  const cell = cellOf(state.scale, blur);
  return cell ? cell.dims.map((k, i) => [k, entryOf(cell, i)]) : [];
}

function drawDeviation({ title, y, at }) {
  const curves = comparedSeries().map((series) => {
    const limits = limitsOf(series);
    const column = (i) => limits.map(([x, seven]) => [x, seven && seven[i]]);
    return { ...series, points: column(at[0]), upper: at.length > 1 ? column(at[1]) : undefined };
  }).filter(({ points }) => points.some(([, value]) => value !== null));
  if (!curves.length) return html("p", { class: "absent" }, `${title}: not measured here`);
  const byScale = state.against === "scale";
  const x = byScale ? { label: "down-scaling, times", unit: "times" } : dimsAxis;
  return linePlot({ title, x, y, curves, at: byScale ? state.scale : chosenDims() });
}

function drawReliabilityLegend() {
  return legend(comparedSeries()).childNodes;
}

// Means of limits as the columns of a table.
const limitColumns = ["orientation, °", "altitude ratio", "gamma", "catchment, %"];

function limitCells(seven) {
  if (!seven) return limitColumns.map(() => html("td", {}, "–"));
  const [left, right, low, high, dark, bright, area] = seven.map((value) => (value === null ? "–" : words(value)));
  return [`${left} to ${right}`, `${low} to ${high}`, `${dark} to ${bright}`, area].map((text) => html("td", {}, text));
}
