// Line plots: axes with round ticks, curves, bands between pairs of curves, and the nearest point in words.

const plotBox = { width: 420, height: 270, left: 66, right: 12, top: 30, bottom: 44 };

// curves: [{name, color, dash, strong, points: [[x, y], …], upper: [[x, y], …] or none}]; at: x of an upright line. A
// title that is too long for the plot stands elsewhere: its heading is then empty.
function linePlot({ title, heading = title, x, y, curves, at = null }) {
  const axes = { x: axis(x, curves, 0, plotBox.left, plotBox.width - plotBox.right), y: axis(y, curves, 1, plotBox.height - plotBox.bottom, plotBox.top) };
  const label = `${title}: ${y.label} against ${x.label}; ${curves.map(({ name }) => name).join(", ")}`;
  const plot = svg("svg", { class: "plot", viewBox: `0 0 ${plotBox.width} ${plotBox.height}`, role: "img", "aria-label": label },
    svg("text", { class: "title", x: plotBox.left, y: 17 }, heading),
    ...gridLines(axes), ...axisLabels(x, y));
  if (at !== null && at >= axes.x.from && at <= axes.x.to) {
    plot.append(svg("line", { class: "at", x1: axes.x.place(at), x2: axes.x.place(at), y1: plotBox.top, y2: plotBox.height - plotBox.bottom }));
  }
  // Chosen curves lie over the others.
  for (const curve of [...curves].sort((a, b) => !!a.strong - !!b.strong)) plot.append(...drawCurve(curve, axes));
  const readout = html("p", { class: "readout" }, "\u00a0");
  followNearest(plot, axes, curves, readout, x, y);
  return [plot, readout];
}

function axis({ log, range, count }, curves, which, start, end) {
  const values = curves.flatMap(({ points, upper = [] }) => [...points, ...upper]).map((point) => point[which]);
  const usable = values.filter((value) => Number.isFinite(value) && (!log || value > 0));
  let [from, to] = range ?? [Math.min(...usable), Math.max(...usable)];
  if (!usable.length && !range) [from, to] = [log ? 0.5 : 0, log ? 2 : 1];
  if (from === to) [from, to] = log ? [from / 1.5, to * 1.5] : [from - 0.5, to + 0.5];
  if (!range) [from, to] = which === 0 ? [from > 0 && from < 0.1 * to && !log ? 0 : from, to] : widened(from, to, log);
  const scale = log ? Math.log : (value) => value;
  const place = (value) => start + ((scale(value) - scale(from)) / (scale(to) - scale(from))) * (end - start);
  return { from, to, place, ticks: log ? logTicks(from, to) : ticks(from, to, count ?? (which === 0 ? 6 : 5)) };
}

// Room above and below, so that no curve runs along the frame; zero stays the floor of what is never negative.
function widened(from, to, log) {
  if (log) return [from / 1.08, to * 1.08];
  const room = 0.06 * (to - from);
  return [from >= 0 && from < 0.3 * to ? 0 : from - room, to + room];
}

function gridLines(axes) {
  const { left, right, top, bottom, width, height } = plotBox;
  const rows = axes.y.ticks.map((tick) => [
    svg("line", { class: "grid", x1: left, x2: width - right, y1: axes.y.place(tick), y2: axes.y.place(tick) }),
    svg("text", { class: "tick", x: left - 6, y: axes.y.place(tick) + 4, "text-anchor": "end" }, words(tick, 6)),
  ]);
  const columns = axes.x.ticks.map((tick) => [
    svg("line", { class: "grid", x1: axes.x.place(tick), x2: axes.x.place(tick), y1: height - bottom, y2: height - bottom + 4 }),
    svg("text", { class: "tick", x: axes.x.place(tick), y: height - bottom + 17, "text-anchor": "middle" }, words(tick, 6)),
  ]);
  const frame = svg("path", { class: "frame", d: `M${left} ${top}V${height - bottom}H${width - right}` });
  return [...rows, ...columns].flat().concat(frame);
}

function axisLabels(x, y) {
  const middle = (plotBox.top + plotBox.height - plotBox.bottom) / 2;
  return [
    svg("text", { class: "label", x: (plotBox.left + plotBox.width - plotBox.right) / 2, y: plotBox.height - 7, "text-anchor": "middle" }, x.label),
    svg("text", { class: "label", transform: `translate(11 ${middle}) rotate(-90)`, "text-anchor": "middle" }, y.label),
  ];
}

// Gaps in the data stay gaps in the curve.
function pathOf(points, axes) {
  let pen = "M";
  return points.map(([x, y]) => {
    if (!isDrawn([x, y], axes)) return (pen = "M"), "";
    const step = `${pen}${axes.x.place(x).toFixed(1)} ${axes.y.place(y).toFixed(1)}`;
    pen = "L";
    return step;
  }).join("");
}

const isDrawn = ([, y], axes) => y !== null && Number.isFinite(axes.y.place(y));

function drawCurve({ color, dash, strong, points, upper }, axes) {
  const drawn = [];
  if (upper && strong) {
    const between = [...points, ...[...upper].reverse()].filter((point) => isDrawn(point, axes));
    if (between.length) drawn.push(svg("path", { class: "band", d: `${pathOf(between, axes)}Z`, fill: color }));
  }
  for (const line of upper ? [points, upper] : [points]) {
    drawn.push(svg("path", { class: "curve", d: pathOf(line, axes), style: `stroke:${color};stroke-width:${strong ? 2.8 : 1.5}`, "stroke-dasharray": dash }));
    // A single measurement would not be seen as a line.
    const seen = line.filter((point) => isDrawn(point, axes));
    if (seen.length === 1) drawn.push(svg("circle", { cx: axes.x.place(seen[0][0]), cy: axes.y.place(seen[0][1]), r: 4, fill: color }));
  }
  return drawn;
}

function followNearest(plot, axes, curves, readout, x, y) {
  const ring = svg("circle", { class: "ring", r: 5, cx: -99, cy: -99 });
  plot.append(ring);
  const candidates = curves.flatMap(({ name, points, upper = [] }) =>
    [...points, ...upper].filter((point) => isDrawn(point, axes)).map((point) => ({ name, point, cx: axes.x.place(point[0]), cy: axes.y.place(point[1]) })));
  const follow = (event) => {
    if (!candidates.length) return;
    const box = plot.getBoundingClientRect();
    const px = ((event.clientX - box.left) / box.width) * plotBox.width;
    const py = ((event.clientY - box.top) / box.height) * plotBox.height;
    const off = ({ cx, cy }) => (cx - px) ** 2 + (cy - py) ** 2;
    const best = candidates.reduce((a, b) => (off(b) < off(a) ? b : a));
    fill(ring, { cx: best.cx, cy: best.cy }, []);
    readout.textContent = `${best.name}: ${words(best.point[1], 4)}${y.unit ?? ""} at ${words(best.point[0], 4)} ${x.unit ?? ""}`;
  };
  plot.addEventListener("pointermove", follow);
  plot.addEventListener("pointerdown", follow);
}
