// What is chosen, the controls that choose it, and the address that links to it.

const state = {
  ...data.defaults,
  criterion: "nearest",
  lattice: "all",
  against: "dims",
  compare: "blurs",
  linkage: "average",
  by: "linkage",
  clusters: Math.min(15, data.views.length),
  cut: "15",
  alone: "0",
  landmark: null,
};
let usual = state;
const alwaysLinked = ["scale", "blur", "dims", "method", "criterion"];
const pictures = [];
const controls = [];

const chosenCell = () => cellOf(state.scale, state.blur);
const dimsHere = () => chosenCell()?.dims ?? [...new Set(data.cells.flatMap((cell) => cell.dims))].sort((a, b) => a - b);
const chosenIndex = () => nearestDims(dimsHere(), state.dims);
const chosenDims = () => dimsHere()[chosenIndex()];

// A picture is drawn again when something that it needs changes.
function picture(id, needs, draw) {
  const host = document.getElementById(id);
  pictures.push({ needs, draw: () => host.replaceChildren(...[draw(host)].flat().filter(Boolean)) });
}

// A picture of one cell; where there is none it says so.
function cellPicture(id, needs, draw) {
  picture(id, ["scale", "blur", ...needs], (host) => {
    const cell = chosenCell();
    const drawn = cell && draw(cell, host);
    return drawn || html("p", { class: "absent" }, cell ? "not measured" : "not computed for this scale and blur");
  });
}

function change(changes) {
  const changed = Object.keys(changes).filter((key) => changes[key] !== state[key]);
  if (!changed.length) return;
  Object.assign(state, changes);
  controls.forEach((refresh) => refresh());
  pictures.filter(({ needs }) => needs.some((key) => changed.includes(key))).forEach(({ draw }) => draw());
  mark(chosenView);
  writeAddress();
}

// Browsers slow pages down that rewrite their address at every step of a slider.
let pendingAddress;
function writeAddress() {
  clearTimeout(pendingAddress);
  pendingAddress = setTimeout(() => {
    const linked = Object.keys(state).filter((key) => alwaysLinked.includes(key) || state[key] !== usual[key]);
    const query = new URLSearchParams(linked.map((key) => [key, state[key]]));
    history.replaceState(null, "", `#${query}`);
  }, 200);
}

// What was offered first need not stand in the address.
function settle() {
  usual = { ...state };
}

function readAddress() {
  const query = new URLSearchParams(location.hash.slice(1));
  const changes = {};
  for (const [key, text] of query) {
    if (!Object.hasOwn(state, key)) continue;
    const value = typeof state[key] === "number" ? Number(text) : text;
    if (!Number.isNaN(value) && isOffered(key, value)) changes[key] = value;
  }
  return changes;
}

// Addresses are typed and outlive pages: only what this page offers is taken from them.
function isOffered(key, value) {
  const offered = {
    scale: data.scales,
    blur: data.blurs,
    method: data.methods.map(({ id }) => id),
    criterion: ["nearest", "guaranteed"],
    lattice: ["all", "first", "second"],
    against: ["dims", "scale"],
    compare: ["blurs", "methods"],
    by: ["linkage", "k-means"],
    linkage: linkageNames,
  }[key];
  if (key === "clusters") return Number.isInteger(value) && value >= 1 && value <= data.views.length;
  return !offered || offered.includes(value);
}

// A list to choose from. `options` gives [value, text] pairs, and may depend on what is chosen elsewhere.
function listControl(name, options) {
  const select = document.querySelector(`select[name="${name}"]`);
  const number = typeof options()[0]?.[0] === "number";
  select.addEventListener("change", () => change({ [name]: number ? Number(select.value) : select.value }));
  let shown = "";
  onState(() => {
    const offered = options();
    if (shown !== (shown = JSON.stringify(offered))) {
      select.replaceChildren(...offered.map(([value, text]) => html("option", { value }, text)));
      plainIfAlone(select, offered);
    }
    if (!offered.some(([value]) => value === state[name]) && offered.length) state[name] = offered[0][0];
    select.value = state[name];
  });
}

// A row of buttons of which one is pressed.
function choiceControl(name, options) {
  const group = document.querySelector(`fieldset[data-name="${name}"]`);
  group.hidden = options.length < 2;
  const inputs = options.map(([value]) => html("input", { type: "radio", name, value }));
  const labels = options.map(([, text], i) => html("label", {}, inputs[i], html("span", {}, text)));
  group.append(html("div", { class: "buttons" }, ...labels));
  group.addEventListener("change", (event) => change({ [name]: event.target.value }));
  onState(() => inputs.forEach((input) => (input.checked = input.value === state[name])));
}

// A slider over the values of a list.
function sliderControl(name, values, chosen) {
  const slider = document.querySelector(`input[name="${name}"]`);
  const shown = document.getElementById(`${name}-shown`);
  slider.addEventListener("input", () => change({ [name]: values()[Number(slider.value)] }));
  onState(() => {
    slider.min = 0;
    slider.max = values().length - 1;
    slider.value = values().indexOf(chosen());
    slider.hidden = values().length < 2;
    slider.setAttribute("aria-valuetext", chosen());
    shown.textContent = chosen();
  });
}

function onState(refresh) {
  controls.push(refresh);
  refresh();
}

// With nothing to choose a control is only words.
function plainIfAlone(select, offered) {
  select.parentElement.querySelector(".only")?.remove();
  select.hidden = offered.length < 2;
  if (offered.length === 1) select.after(html("span", { class: "only" }, offered[0][1]));
}

// The view that is pointed at is marked wherever it appears.
let chosenView = 1;
function mark(view) {
  document.querySelectorAll(".chosen").forEach((element) => element.classList.remove("chosen"));
  document.querySelectorAll(`[data-view="${view}"]`).forEach((element) => element.classList.add("chosen"));
  const changed = view !== chosenView;
  chosenView = view;
  if (changed || !document.getElementById("selected").textContent) describeView(view);
}

function followPointer() {
  const follow = (event) => {
    const view = viewAt(event);
    if (view && view !== chosenView) mark(view);
  };
  document.addEventListener("pointermove", follow);
  document.addEventListener("pointerdown", follow);
  document.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -1, ArrowUp: -1, ArrowRight: 1, ArrowDown: 1 }[event.key];
    if (!step || !event.target.closest?.("[data-walk]")) return;
    event.preventDefault();
    const n = data.views.length;
    mark(((chosenView - 1 + step + n) % n) + 1);
  });
}

// Frames overlap on a map: there the nearest center counts, not the frame on top.
function viewAt({ target, clientX, clientY }) {
  const map = target.closest?.(".aerial");
  if (!map) return Number(target.closest?.("[data-view]")?.dataset.view);
  const box = map.getBoundingClientRect();
  const x = ((clientX - box.left) / box.width) * mapWidth;
  const y = ((clientY - box.top) / box.height) * mapHeight;
  const off = (view) => Math.max(Math.abs(data.views[view - 1][0] - x), Math.abs(data.views[view - 1][1] - y));
  const shown = [...map.querySelectorAll("rect[data-view]")].map((element) => Number(element.dataset.view));
  return shown.filter((view) => off(view) <= footprint / 2).sort((a, b) => off(a) - off(b))[0];
}

function describeView(view) {
  const [x, y] = data.views[view - 1];
  document.getElementById("selected").textContent = `View ${view}, center at ${x}, ${y} on the map`;
}
