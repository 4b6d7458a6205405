// What was measured: the data of the page, cell by cell, and what follows from it by arithmetic.

const data = JSON.parse(document.getElementById("data").textContent);
const viewNumbers = data.views.map((_, i) => i + 1);

const cellOf = (scale, blur) => data.cells.find((cell) => cell.scale === scale && cell.blur === blur);

// Base64 is decoded when it is first asked for: most cells are never looked at.
const decoded = new WeakMap();
function remember(owner, key, compute) {
  if (!decoded.has(owner)) decoded.set(owner, new Map());
  const kept = decoded.get(owner);
  if (!kept.has(key)) kept.set(key, compute());
  return kept.get(key);
}

function bytesOf(base64) {
  return Uint8Array.from(atob(base64), (character) => character.charCodeAt(0)).buffer;
}

const numbers = (owner, key, Type) => remember(owner, key, () => new Type(bytesOf(owner[key])));

// Index of the computed number of dimensions nearest to the wanted one.
function nearestDims(dims, wanted) {
  const off = dims.map((k) => Math.abs(k - wanted));
  return off.indexOf(Math.min(...off));
}

// nSSD of all pairs, n rows of n, in the first k dimensions.
function distances(cell, k) {
  return remember(cell, `distances ${k}`, () => {
    const n = data.views.length;
    const points = numbers(cell, "coordinates", Float32Array);
    const width = points.length / n;
    const matrix = new Float32Array(n * n);
    for (let a = 0; a < n; a++) {
      for (let b = a + 1; b < n; b++) {
        let difference = 0;
        let sizes = 0;
        for (let d = 0; d < k; d++) {
          const x = points[a * width + d];
          const y = points[b * width + d];
          difference += (x - y) * (x - y);
          sizes += x * x + y * y;
        }
        matrix[a * n + b] = matrix[b * n + a] = sizes > 0 ? difference / (2 * sizes) : 0;
      }
    }
    return matrix;
  });
}

// Mean dissimilarity of each view to all others.
function profile(cell, k) {
  return remember(cell, `profile ${k}`, () => {
    const n = data.views.length;
    const matrix = distances(cell, k);
    const sum = (a) => matrix.subarray(a * n, (a + 1) * n).reduce((total, x) => total + x, 0);
    return Float32Array.from(data.views, (_, a) => sum(a) / Math.max(1, n - 1));
  });
}

// Mean and standard deviation over the pairs of different views.
function meanAndSpread(matrix) {
  const n = data.views.length;
  const pairs = [];
  for (let a = 0; a < n; a++) for (let b = a + 1; b < n; b++) pairs.push(matrix[a * n + b]);
  const mean = pairs.reduce((total, x) => total + x, 0) / pairs.length;
  const square = pairs.reduce((total, x) => total + (x - mean) ** 2, 0) / pairs.length;
  return [mean, Math.sqrt(square)];
}

function cumulated(shares) {
  let covered = 0;
  return shares.map((share) => (covered += share));
}

// Merges of a linkage: which two clusters become one, and at which height.
function mergesOf(linkage) {
  return remember(linkage, "records", () => {
    const records = new DataView(bytesOf(linkage.merges));
    return Array.from({ length: records.byteLength / 8 }, (_, i) => ({
      a: records.getUint16(8 * i, true),
      b: records.getUint16(8 * i + 2, true),
      height: records.getFloat32(8 * i + 4, true),
    }));
  });
}

// Leaves from left to right, so that no two branches of the dendrogram cross.
function leafOrder(merges, n) {
  const order = [];
  const open = [n + merges.length - 1];
  while (open.length) {
    const node = open.pop();
    if (node < n) order.push(node);
    else open.push(merges[node - n].b, merges[node - n].a);
  }
  return order;
}

// Cluster of each node of the dendrogram when it is cut into `count`, numbered from the left; null above the cut.
function cutMerges(merges, count) {
  const n = merges.length + 1;
  const whole = n + (n - count);
  const parent = new Array(2 * n - 1).fill(null);
  merges.forEach(({ a, b }, i) => (parent[a] = parent[b] = n + i));
  const rootOf = (node) => {
    while (parent[node] !== null && parent[node] < whole) node = parent[node];
    return node;
  };
  const ids = new Map();
  for (const leaf of leafOrder(merges, n)) {
    const root = rootOf(leaf);
    if (!ids.has(root)) ids.set(root, ids.size);
  }
  return parent.map((_, node) => (node < whole ? ids.get(rootOf(node)) : null));
}
