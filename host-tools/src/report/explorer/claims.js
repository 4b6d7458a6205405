// Claims of the 2004 report with what was found, and the effects of segmentation.

const verdicts = new Map([[true, ["holds", "✓"]], [false, ["does not hold", "✗"]], [null, ["not measured", "–"]]]);

function verdict(holds) {
  const [text, sign] = verdicts.get(holds ?? null);
  return html("span", { class: `verdict ${text.replaceAll(" ", "-")}` }, html("span", { "aria-hidden": "true" }, sign), ` ${text}`);
}

function drawClaims() {
  const head = html("tr", {}, ...["claim", "holds or not", "numbers"].map((text) => html("th", { scope: "col" }, text)));
  return html("table", { class: "claims" }, html("caption", { class: "unseen" }, "Claims of the report"), html("thead", {}, head), ...data.claims.map(claimRows));
}

function claimRows({ claim, statement, holds, parts, plots }) {
  const numbers = html("ul", {}, ...parts.map((part) => html("li", {}, `${part.what}: `, html("b", {}, part.numbers), " ", verdict(part.holds))));
  const row = html("tr", {}, html("th", { scope: "row" }, `${claim}. ${statement}`), html("td", {}, verdict(holds)), html("td", {}, numbers));
  if (!plots.length) return html("tbody", {}, row);
  const details = html("details", { id: `claim-${claim}` }, html("summary", {}, `${plots.length === 1 ? "Plot" : `${plots.length} plots`} of claim ${claim}`));
  // Most are never opened, so they are drawn when they are.
  details.addEventListener("toggle", () => details.open && details.append(html("div", { class: "plots two" }, ...plots.map(claimPlot))), { once: true });
  return html("tbody", {}, row, html("tr", { class: "more" }, html("td", { colspan: 3 }, details)));
}

function claimPlot({ title, x, y, curves }) {
  const looks = curves.map((curve, i) => ({ ...curve, ...look(i, curves.length) }));
  return html("figure", {}, html("figcaption", {}, title), ...linePlot({ title, heading: "", x: { label: x, unit: `(${x})` }, y: { label: y }, curves: looks }), legend(looks));
}

function drawSegmented() {
  return html("img", { src: data.segmentation.uri, alt: "The map in the grays of its palette" });
}

function drawPalette() {
  return html("table", { class: "palette" }, html("tr", {}, ...["color", "gray", "share"].map((text) => html("th", { scope: "col" }, text))),
    ...data.segmentation.palette.map(({ rgb, gray, share }) => html("tr", {},
      html("td", {}, swatch(rgb), rgb), html("td", {}, swatch(`rgb(${gray} ${gray} ${gray})`), gray), html("td", {}, percent(share)))));
}

const swatch = (color) => html("span", { class: "swatch", style: `background:${color}`, "aria-hidden": "true" });

function drawSegmentation() {
  const head = html("tr", {}, ...["", ...limitColumns].map((text) => html("th", { scope: "col" }, text)));
  const rows = data.segmentation.rows.map((row) => html("tr", {}, html("th", { scope: "row" }, row.name), ...limitCells(row[state.criterion])));
  return html("table", {}, html("caption", {}, `Criterion: ${state.criterion}`), head, ...rows);
}
