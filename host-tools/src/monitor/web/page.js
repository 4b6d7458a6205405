// Asks for the state ten times a second, keeps the way, and draws it over the map.
"use strict";

const byId = (id) => document.getElementById(id);
const canvas = byId("canvas");
const pen = canvas.getContext("2d");
const picture = byId("picture");
const tools = byId("tools").elements;
const LONGEST = 10000;
const colors = { dark: "#0b0e13", way: "#ffb224", place: "#c6d2e4", vehicle: "#3ff0ff", fixes: ["#4be08a", "#ffd24a", "#ff5c6c"] };

let terrain = null;
let map = null;
let samples = [];
let next = 0;
let last = null;
let shownPicture = null;
let labelled = 0;

function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) if (value !== null) made.setAttribute(key, value);
  made.append(...children);
  return made;
}

const isNumber = (value) => typeof value === "number" && Number.isFinite(value);
const fixed = (value, digits = 1) => (isNumber(value) ? value.toFixed(digits).replace("-", "−") : "–");
const percent = (share) => (isNumber(share) ? `${Math.round(100 * share)} %` : "–");
const degrees = (rad) => (isNumber(rad) ? `${(((rad * 180) / Math.PI + 360) % 360).toFixed(0)}°` : "–");
const seconds = (ms) => `${fixed(ms / 1000)} s`;

// Texts change only where they differ, so that what is selected or read aloud stays.
function list(id, entries) {
  const target = byId(id);
  const shown = entries.filter((entry) => entry);
  while (target.children.length > 2 * shown.length) target.lastElementChild.remove();
  shown.forEach(([term, text, kind], i) => {
    if (!target.children[2 * i]) target.append(element("dt", {}), element("dd", {}));
    const [dt, dd] = [target.children[2 * i], target.children[2 * i + 1]];
    if (dt.textContent !== term) dt.textContent = term;
    if (dd.textContent !== text) dd.textContent = text;
    if (dd.className !== (kind ?? "")) dd.className = kind ?? "";
  });
}

function say(id, text) {
  const target = byId(id);
  if (target.textContent !== text) target.textContent = text;
}

function showLink({ state, name, why }) {
  const words = { up: "link up", silent: "link silent", down: "link down", gone: "monitor ended" };
  say("link-state", words[state]);
  byId("link-state").className = `pill ${state}`;
  say("link-name", why ? `${name}: ${why}` : name);
}

function showNow({ report, report_age_s: age }) {
  if (!report) return list("now", [["report", "none yet"]]);
  const { estimate, fix } = report;
  const ellipse = estimate && axes(estimate.covariance_px2);
  list("now", [
    ["frame", `${report.sequence}, ${fixed(age)} s ago`, age > 2 ? "warn" : null],
    ["position", estimate ? `${fixed(estimate.position[0])}, ${fixed(estimate.position[1])}` : "nowhere yet"],
    estimate && ["confidence", `${fixed(100 * estimate.confidence)} %${estimate.confident ? "" : ", not enough"}`, estimate.confident ? "good" : "warn"],
    ellipse && ["one sigma", `${fixed(ellipse.major)} by ${fixed(ellipse.minor)} px`],
    estimate && ["heading", degrees(estimate.heading_rad)],
    ["fix", fix ? `landmark ${fix.landmark}, ${report.judgement}` : "none", report.judgement ?? null],
    report.refusal && ["refused", report.refusal, "bad"],
    ["mission", report.state],
    ["asks for", `heading ${degrees(report.command.heading_rad)}, speed ${percent(report.command.speed)}`],
    ["autopilot", `heading ${degrees(report.heading_rad)}, altitude ${fixed(report.altitude_ratio, 2)}×`],
    ["camera", report.camera, report.camera === "frame" ? null : "bad"],
  ]);
}

function showRates({ rates }) {
  const ms = (us) => (isNumber(us) ? `${fixed(us / 1000)} ms` : "–");
  list("rates", [
    ["frames", `${fixed(rates.frames_per_s)} per second`],
    ["reports", `${fixed(rates.reports_per_s)} per second`],
    ["fixes", `${fixed(rates.fixes_per_s)} per second`],
    ["known", percent(rates.known)],
    ["guaranteed", percent(rates.guaranteed)],
    ["step", `${ms(rates.took_us_mean)}, at worst ${ms(rates.took_us_worst)}`],
  ]);
}

function showCounts(state) {
  list("counts", [
    ["reports", `${state.reports}, ${state.lost_reports} lost`],
    ["damaged", `${state.damaged_packets} packets here, ${state.report?.damaged ?? 0} at the board`],
    ["begun anew", String(state.restarts), state.restarts ? "warn" : null],
    state.broken_pictures && ["pictures", `${state.broken_pictures} did not come whole`],
    ...state.refusals.map(([why, count]) => [String(count), why]),
  ]);
}

function showBoard({ identity, slots, faults }) {
  list("board", [
    ["firmware", identity?.firmware ?? "has not said who it is"],
    identity && ["flies by", identity.atlas ?? "no atlas", identity.atlas ? null : "bad"],
    identity && ["scale", `${fixed(identity.meters_per_px, 2)} m per pixel`],
    identity && ["camera", `field of view ${fixed((identity.field_of_view_rad * 180) / Math.PI)}°`],
    ...(slots ?? []).map((slot, i) => [`slot ${"ab"[i]}`, slot]),
    ...(faults ?? []).map((fault, i) => [i ? "" : "faults", fault, i ? "bad" : null]),
  ]);
}

function showFixes({ recent }) {
  const rows = recent.map(({ time_ms, landmark, judgement, refusal }) => {
    const words = [judgement ?? (landmark ? "" : "no fix"), refusal].filter((word) => word).join(": ");
    return element("tr", {}, element("td", {}, seconds(time_ms)), element("td", {}, landmark ? String(landmark) : "–"), element("td", { class: judgement }, words));
  });
  byId("fixes").replaceChildren(...rows);
}

function showEvents({ events }) {
  const key = JSON.stringify(events);
  if (byId("events").dataset.key === key) return;
  byId("events").dataset.key = key;
  byId("events").replaceChildren(...events.map(([at, text]) => element("li", {}, element("time", {}, `${fixed(at)} s`), ` ${text}`)));
}

function showPicture({ picture: of }) {
  if (!of || of[0] === shownPicture) return;
  shownPicture = of[0];
  picture.src = `/picture.png?sequence=${of[0]}`;
  picture.hidden = false;
  say("picture-caption", `Frame ${of[0]}, ${of[1]}×${of[2]} pixels.`);
}

function keep({ first, next: following, of }) {
  if (first > next && samples.length) samples = [];
  samples.push(...of.map(([at, confident, fix, judgement, anew]) => ({ at: at && at.map(tenth), confident, fix: fix && fix.map(tenth), judgement, anew })));
  if (samples.length > LONGEST) samples = samples.slice(-LONGEST);
  next = following;
}

const tenth = (value) => value / 10;

// Half axes of one sigma and the angle of the longer one, x right, y down.
function axes([xx, xy, yy]) {
  const [mean, half] = [(xx + yy) / 2, (xx - yy) / 2];
  const radius = Math.hypot(half, xy);
  return { major: Math.sqrt(Math.max(0, mean + radius)), minor: Math.sqrt(Math.max(0, mean - radius)), angle: Math.atan2(xy, half) / 2 };
}

// What part of the map is shown: left, top, width, height.
function extent() {
  const at = last?.report?.estimate?.position;
  const [width, height] = terrain.size_px ?? bounds();
  if (tools.shown.value === "near" && at) {
    const side = 4 * (terrain.footprint_px ?? Math.max(width, height) / 8);
    const high = (side * height) / width;
    return [at[0] - side / 2, at[1] - high / 2, side, high];
  }
  return [0, 0, width, height];
}

function bounds() {
  const points = samples.map(({ at }) => at).filter((at) => at);
  return [0, 1].map((axis) => Math.max(400 - 100 * axis, ...points.map((at) => 1.1 * at[axis])));
}

function draw() {
  if (!terrain) return;
  const [left, top, width, height] = extent();
  const css = canvas.clientWidth;
  const dense = window.devicePixelRatio || 1;
  const high = Math.min((css * height) / width, Math.max(320, 0.72 * innerHeight));
  const size = [css, high].map((side) => Math.round(side * dense));
  if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
  const scale = Math.min(size[0] / width, size[1] / height);
  const unit = dense * Math.max(0.7, Math.min(1, css / 700));
  pen.setTransform(1, 0, 0, 1, 0, 0);
  pen.clearRect(0, 0, ...size);
  pen.setTransform(scale, 0, 0, scale, size[0] / 2 - (left + width / 2) * scale, size[1] / 2 - (top + height / 2) * scale);
  if (map?.naturalWidth) {
    pen.drawImage(map, 0, 0, ...terrain.size_px);
    pen.fillStyle = "#0b0e1366";
    pen.fillRect(0, 0, ...terrain.size_px);
  }
  const px = unit / scale;
  if (tools.places.checked) drawPlaces(px);
  if (tools.way.checked) drawWay(px);
  if (tools.fixes.checked) drawFixes(px);
  drawVehicle(px);
  const now = Date.now();
  if (now - labelled > 5000) {
    labelled = now;
    const at = last?.report?.estimate?.position;
    canvas.setAttribute("aria-label", at ? `Map with the vehicle at ${fixed(at[0], 0)}, ${fixed(at[1], 0)}` : "Map without a position yet");
  }
}

function drawPlaces(px) {
  pen.strokeStyle = `${colors.place}70`;
  pen.lineWidth = 1.5 * px;
  pen.beginPath();
  for (const [from, to] of terrain.legs) {
    pen.moveTo(...terrain.places[from]);
    pen.lineTo(...terrain.places[to]);
  }
  pen.stroke();
  pen.fillStyle = colors.place;
  for (const at of terrain.places) disc(at, 2.5 * px);
}

function disc([x, y], radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 2 * Math.PI);
  pen.fill();
}

// Where an estimate jumps, or the board began anew, the way is interrupted.
function drawWay(px) {
  const far = (terrain.footprint_px ?? 100) / 2;
  const ways = [new Path2D(), new Path2D()];
  for (let i = 1; i < samples.length; i++) {
    const [before, now] = [samples[i - 1], samples[i]];
    if (!before.at || !now.at || now.anew || Math.hypot(now.at[0] - before.at[0], now.at[1] - before.at[1]) > far) continue;
    const way = ways[now.confident ? 1 : 0];
    way.moveTo(...before.at);
    way.lineTo(...now.at);
  }
  pen.lineCap = "round";
  pen.strokeStyle = `${colors.dark}a0`;
  pen.lineWidth = 5 * px;
  pen.stroke(ways[1]);
  pen.strokeStyle = `${colors.way}b0`;
  pen.lineWidth = 1.6 * px;
  pen.setLineDash([2 * px, 4 * px]);
  pen.stroke(ways[0]);
  pen.setLineDash([]);
  pen.strokeStyle = colors.way;
  pen.lineWidth = 2.8 * px;
  pen.stroke(ways[1]);
}

function drawFixes(px) {
  const r = 3.2 * px;
  const paths = [new Path2D(), new Path2D(), new Path2D()];
  for (const { fix, judgement } of samples) {
    if (!fix) continue;
    const [x, y] = fix;
    const path = paths[judgement];
    if (judgement === 0) {
      path.moveTo(x + r, y);
      path.arc(x, y, r, 0, 2 * Math.PI);
    } else if (judgement === 1) {
      [[0, -r], [r, 0], [0, r], [-r, 0], [0, -r]].forEach(([dx, dy], i) => (i ? path.lineTo(x + dx, y + dy) : path.moveTo(x + dx, y + dy)));
    } else {
      path.moveTo(x - r, y - r);
      path.lineTo(x + r, y + r);
      path.moveTo(x - r, y + r);
      path.lineTo(x + r, y - r);
    }
  }
  pen.strokeStyle = colors.dark;
  pen.lineWidth = 3.4 * px;
  pen.stroke(paths[2]);
  pen.strokeStyle = colors.fixes[2];
  pen.lineWidth = 1.6 * px;
  pen.stroke(paths[2]);
  for (const judgement of [1, 0]) {
    pen.strokeStyle = colors.dark;
    pen.lineWidth = 1.6 * px;
    pen.stroke(paths[judgement]);
    pen.fillStyle = colors.fixes[judgement];
    pen.fill(paths[judgement]);
  }
}

function drawVehicle(px) {
  const estimate = last?.report?.estimate;
  if (!estimate) return;
  const fix = last.report.fix;
  const side = terrain.footprint_px;
  const { major, minor, angle } = axes(estimate.covariance_px2);
  if (fix && side) {
    pen.strokeStyle = `${colors.vehicle}80`;
    pen.lineWidth = 1.4 * px;
    pen.setLineDash([6 * px, 4 * px]);
    pen.strokeRect(fix.place[0] - side / 2, fix.place[1] - side / 2, side, side);
    pen.setLineDash([]);
  }
  const [x, y] = estimate.position;
  if (isNumber(major) && isNumber(minor)) {
    pen.beginPath();
    pen.ellipse(x, y, 2 * major, 2 * minor, angle, 0, 2 * Math.PI);
    pen.fillStyle = `${colors.vehicle}2e`;
    pen.fill();
    pen.strokeStyle = colors.vehicle;
    pen.lineWidth = 1.8 * px;
    pen.stroke();
  }
  pen.save();
  pen.translate(x, y);
  pen.rotate(estimate.heading_rad ?? 0);
  pen.beginPath();
  [[0, -13], [8, 9], [0, 5], [-8, 9]].forEach(([dx, dy], i) => (i ? pen.lineTo(dx * px, dy * px) : pen.moveTo(dx * px, dy * px)));
  pen.closePath();
  pen.fillStyle = estimate.confident ? colors.vehicle : "#ffffff";
  pen.strokeStyle = colors.dark;
  pen.lineWidth = 2 * px;
  pen.stroke();
  pen.fill();
  pen.restore();
}

function show(state) {
  if (last && state.now_s < last.now_s) return location.reload();
  last = state;
  showLink(state.link);
  keep(state.samples);
  [showNow, showRates, showCounts, showBoard, showFixes, showEvents, showPicture].forEach((part) => part(state));
  draw();
}

async function read(path) {
  const answer = await fetch(path, { cache: "no-store" });
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

async function follow() {
  let pause = 100;
  try {
    terrain ??= await read("/terrain.json");
    if (terrain.has_picture && !map) {
      map = new Image();
      map.addEventListener("load", draw);
      map.src = "/map.jpg";
    }
    show(await read(`/state.json?from=${next}`));
    if (document.hidden) pause = 1000;
  } catch {
    showLink({ state: "gone", name: "the monitor does not answer; this page goes on when it does" });
    pause = 1000;
  }
  setTimeout(follow, pause);
}

byId("tools").addEventListener("change", draw);
byId("tools").addEventListener("submit", (event) => event.preventDefault());
addEventListener("resize", draw);
follow();
