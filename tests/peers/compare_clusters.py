"""Compares what `bench clusters` finds with SciPy and scikit-learn.

Dendrograms by every linkage (heights in the order of merges, cophenetic distances and their correlation, cuts) are
SciPy's; silhouettes of k-means are scikit-learn's, of the same clusters. Clusters themselves need not be the same: every
view has to be nearest to the mean of its own, and on average over ten single starts the sum of squared distances may be
larger than scikit-learn's by a tenth. Prints a table and exits 1 when anything differs.

usage: compare_clusters.py BENCH [DATA]
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from scipy.cluster.hierarchy import cophenet, fcluster, linkage
from scipy.spatial.distance import cdist, pdist
from sklearn.cluster import KMeans
from sklearn.metrics import silhouette_samples

# Of heights and distances, relative to the largest; of correlations and silhouettes.
TOLERANCE = 1e-9

# The sum of squared distances over scikit-learn's, both on average over ten starts.
MOST = 1.1

# Map below DATA (None for the built-in one), view size.
MAPS = [
    (None, 200),
    ("aerial/wellington.jpg", 200),
    ("aerial/nust.png", 140),
    ("aerial/kitsap.png", 125),
]

DIMENSIONS = [2, 5, 15]


def run(*command):
    output = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True)
    return json.loads(output.stdout)


def numbered(labels):
    """Clusters numbered by their first views."""
    numbers = {}
    return [numbers.setdefault(label, len(numbers)) for label in labels]


def cut(merges, n, clusters):
    """Clusters before the last merges, by SciPy's rows in their order."""
    of = list(range(n))
    for index, (a, b) in enumerate(merges[: n - clusters, :2].astype(int)):
        of = [n + index if label in (a, b) else label for label in of]
    return numbered(of)


def compare_linkage(points, name, found):
    n = len(points)
    distances = pdist(points)
    merges = linkage(distances, name)
    correlation, cophenetic = cophenet(merges, distances)
    heights = np.array([merge["height"] for merge in found["merges"]])
    differences = {
        "heights": np.abs(heights - merges[:, 2]).max() / merges[:, 2].max(),
        "cophenetic": np.abs(np.array(found["cophenetic"]) - cophenetic).max() / cophenetic.max(),
        "correlation": abs(found["correlation"] - correlation),
    }
    parts = [sorted(merge["clusters"]) for merge in found["merges"]]
    same = parts == np.sort(merges[:, :2].astype(int), axis=1).tolist()
    for clusters, of in found["cuts"].items():
        same &= of == cut(merges, n, int(clusters))
        if name != "centroid":
            same &= of == numbered(fcluster(merges, int(clusters), "maxclust").tolist())
    return same, differences


def compare_k_means(points, clusters, found):
    n, dims = points.shape
    of = np.array(found["of"])
    centroids = np.array(found["centroids"]).reshape(-1, dims)
    means = np.array([points[of == cluster].mean(axis=0) for cluster in range(clusters)])
    squares = cdist(points, centroids, "sqeuclidean")
    same = of.max() + 1 == clusters and (squares.argmin(axis=1) == of).all()
    scale = np.abs(points).max()
    total = np.square(points - points.mean(axis=0)).sum()
    expected = np.zeros(n)
    if 1 < clusters < n:
        expected = silhouette_samples(points, of, metric="sqeuclidean")
    differences = {
        "means": np.abs(means - centroids).max() / scale,
        "ssd": abs(squares[np.arange(n), of].sum() - found["ssd"]) / total,
        "silhouettes": np.abs(np.array(found["silhouettes"]) - expected).max(),
    }
    theirs = np.mean([KMeans(clusters, n_init=1, random_state=seed).fit(points).inertia_ for seed in range(10)])
    # Of as many clusters as views, both are rounding.
    ratio = np.mean(found["ssd_of_starts"]) / theirs if clusters < n else 1.0
    return same and ratio <= MOST, differences, ratio


def compare(points, found):
    is_equal, largest, worst = True, {}, 0.0
    compared = [compare_linkage(points, name, one) for name, one in found["linkages"].items()]
    for clusters, one in found["k_means"].items():
        *same, ratio = compare_k_means(points, int(clusters), one)
        compared.append(same)
        worst = max(worst, ratio)
        point = found["curve"][int(clusters) - 1]
        values = np.array(one["silhouettes"])
        expected = [values.mean(), np.median(values), (values < 0).mean()]
        difference = np.abs(np.array([point["mean"], point["median"], point["negative"]]) - expected).max()
        compared.append((len(found["curve"]) == len(points), {"curve": difference}))
    for same, differences in compared:
        is_equal &= bool(same)
        for key, value in differences.items():
            largest[key] = max(value, largest.get(key, 0.0))
    return is_equal and max(largest.values()) <= TOLERANCE, largest, worst


def main():
    bench, *data = sys.argv[1:]
    passed = failures = 0
    with tempfile.TemporaryDirectory() as directory:
        vectors, all_points, some = (pathlib.Path(directory) / f"{name}.npy" for name in ("vectors", "all", "some"))
        for file, view_size in MAPS:
            if file is None:
                map_name = "builtin:city"
            elif data and (path := pathlib.Path(data[0]) / file).is_file():
                map_name = str(path)
            else:
                print(f"skipped: {file} is absent")
                failures += "EIGENMARK_REQUIRE_DATA" in os.environ
                continue
            run(bench, "candidates", map_name, view_size, 10, 0, 1, vectors)
            run(bench, "coordinates", vectors, all_points)
            for dims in DIMENSIONS:
                points = np.ascontiguousarray(np.load(all_points)[:, :dims])
                np.save(some, points)
                answer = run(bench, "clusters", some, 1)
                is_equal, differences, worst = compare(points, answer["result"])
                passed += is_equal
                failures += not is_equal
                shown = "  ".join(f"{key} {value:.0e}" for key, value in differences.items())
                correlations = " ".join(
                    f"{name} {one['correlation']:.2f}" for name, one in answer["result"]["linkages"].items()
                )
                verdict = "ok" if is_equal else "DIFFERENT"
                print(f"{pathlib.Path(map_name).name:16} k = {dims:2}  {shown}  ssd/theirs up to {worst:.2f}  {verdict}")
                print(f"{'':16} CCC {correlations}; silhouettes of all numbers in {answer['seconds']:.3f} s")
    print(f"{passed} passed, {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
