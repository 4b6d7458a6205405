// Covered variance against dimensions.

const dimsAxis = { label: "dimensions", unit: "dimensions" };
const scaleName = (scale) => `1/${scale}`;

function blurLook(blur) {
  return { name: blur, ...look(data.blurs.indexOf(blur), data.blurs.length), strong: blur === state.blur };
}

function scaleLook(scale) {
  return { name: scaleName(scale), ...look(data.scales.indexOf(scale), data.scales.length), strong: scale === state.scale };
}

function variancePlot(title, cells, lookOf) {
  if (!cells.length) return html("p", { class: "absent" }, "not computed");
  const curves = cells.map((cell) => ({
    ...lookOf(cell),
    points: remember(cell, "covered", () => cumulated(cell.variance)).map((share, i) => [i + 1, 100 * share]),
  }));
  const y = { label: "covered variance, %", unit: " %", range: [0, 100] };
  return [...linePlot({ title, x: dimsAxis, y, curves, at: chosenDims() }), legend(curves)];
}

function drawVarianceOfBlurs() {
  const cells = data.blurs.map((blur) => cellOf(state.scale, blur)).filter(Boolean);
  return variancePlot(`Scale ${scaleName(state.scale)}`, cells, (cell) => blurLook(cell.blur));
}

function drawVarianceOfScales() {
  const cells = data.scales.map((scale) => cellOf(scale, state.blur)).filter(Boolean);
  return variancePlot(`Blur ${state.blur}`, cells, (cell) => scaleLook(cell.scale));
}
