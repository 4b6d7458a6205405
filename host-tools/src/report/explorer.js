// The explorer: which controls there are, which picture needs which of them, and what is left out for want of data.
//
// The files become one script, placed after the data. Order: explorer/cells.js, explorer/elements.js,
// explorer/plot.js, explorer/state.js, explorer/maps.js, explorer/variance.js, explorer/pictures.js,
// explorer/reliability.js, explorer/clusters.js, explorer/claims.js, explorer.js.

const sideOf = (scale) => data.cells.find((cell) => cell.scale === scale)?.side;
const landmarksHere = () => [...new Set(chosenCell()?.localization.map(({ landmark }) => landmark) ?? [])];

function setControls() {
  listControl("scale", () => data.scales.map((scale) => [scale, `${scaleName(scale)} (${sideOf(scale)} px)`]));
  listControl("blur", () => data.blurs.map((blur) => [blur, blur]));
  listControl("method", () => data.methods.map(({ id, name }) => [id, name]));
  sliderControl("dims", dimsHere, chosenDims);
  choiceControl("criterion", [["nearest", "nearest"], ["guaranteed", "guaranteed"]]);
  choiceControl("lattice", latticesOffered());
  choiceControl("against", data.scales.length > 1 ? [["dims", "dimensions"], ["scale", "scale"]] : []);
  choiceControl("compare", [data.blurs, data.methods].every((list) => list.length > 1) ? [["blurs", "blurs"], ["methods", "methods"]] : []);
  listControl("linkage", () => linkageNames.map((name) => [name, name]));
  sliderControl("clusters", () => viewNumbers, () => state.clusters);
  listControl("cut", () => cutsOffered().map((count) => [count, `${count} clusters`]));
  choiceControl("by", [["linkage", "linkage"], ["k-means", "k-means"]]);
  listControl("alone", clustersOffered);
  listControl("landmark", () => landmarksHere().map((view) => [view, `view ${view}`]));
}

function latticesOffered() {
  const [first, second] = data.lattices;
  return second ? [["all", "both"], ["first", `1 to ${first}`], ["second", `${first + 1} to ${first + second}`]] : [];
}

function setPictures() {
  picture("fig-views", ["lattice"], drawViews);
  picture("fig-variance-blurs", ["scale", "blur", "dims"], drawVarianceOfBlurs);
  picture("fig-variance-scales", ["scale", "blur", "dims"], drawVarianceOfScales);
  cellPicture("fig-eigenimages", [], drawEigenimages);
  cellPicture("fig-recovered", [], drawRecovered);
  cellPicture("fig-distances", ["dims"], drawDistances);
  cellPicture("fig-distances-strip", ["dims"], drawDistancesStrip);
  cellPicture("fig-profiles", ["dims"], drawProfiles);
  cellPicture("fig-profiles-sorted", ["dims"], drawSortedProfiles);
  picture("method-about", ["method"], () => data.methods.find(({ id }) => id === state.method)?.about);
  cellPicture("fig-landmarks", ["dims", "method"], drawLandmarks);
  cellPicture("fig-selections", ["dims", "method"], drawSelections);
  picture("fig-starts", [], drawStarts);
  picture("reliability-legend", ["blur", "method", "compare"], () => [...drawReliabilityLegend()]);
  for (const deviation of deviations) {
    picture(`fig-${deviation.id}`, ["scale", "blur", "dims", "method", "criterion", "against", "compare"], () => drawDeviation(deviation));
  }
  setClusterPictures();
  cellPicture("fig-localization", ["landmark"], drawLocalization);
  picture("fig-claims", [], drawClaims);
  if (data.segmentation) {
    picture("fig-segmented", [], drawSegmented);
    picture("fig-palette", [], drawPalette);
    picture("fig-segmentation", ["criterion"], drawSegmentation);
  }
}

function setClusterPictures() {
  if (!hasClusters()) return;
  const coloring = ["dims", "linkage", "by", "clusters", "cut"];
  cellPicture("fig-dendrogram", ["dims", "linkage", "clusters"], drawDendrogram);
  cellPicture("fig-scatter", coloring, drawScatter);
  cellPicture("fig-silhouettes", ["dims", "cut"], drawSilhouettes);
  cellPicture("fig-clusters-map", [...coloring, "alone"], drawClustersOnMap);
  cellPicture("fig-silhouette-curves", ["dims", "cut"], drawSilhouetteCurves);
}

const hasClusters = () => data.cells.some(({ clusters }) => clusters);

// Sections without data are not there, in the contents neither.
function leaveOut() {
  const absent = {
    clusters: !hasClusters(),
    localization: !data.cells.some(({ localization }) => localization.length),
    claims: !data.claims.length,
    distances: data.has_distances === false,
    profiles: data.has_distances === false,
    segmentation: !data.segmentation,
    "start-lists": !data.starts.length,
    "fig-variance-scales": data.scales.length < 2,
  };
  for (const [id, isAbsent] of Object.entries(absent)) document.getElementById(id).hidden = isAbsent;
  const links = [...document.querySelectorAll("section[id]:not([hidden])")].map((section) =>
    html("a", { href: `#${section.id}` }, section.querySelector("h2").textContent));
  document.querySelector(".contents").append(...links);
}

leaveOut();
showMap();
setControls();
settle();
setPictures();
Object.assign(state, readAddress());
controls.forEach((refresh) => refresh());
pictures.forEach(({ draw }) => draw());
mark(chosenView);
followPointer();
// A link to a section replaces the address, which then says again what is chosen.
addEventListener("hashchange", () => {
  change(readAddress());
  writeAddress();
});
document.getElementById("bar").addEventListener("submit", (event) => event.preventDefault());
