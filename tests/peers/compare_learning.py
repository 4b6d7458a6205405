"""Compares what `eigenmark train --export` wrote with scikit-learn and NumPy.

PCA (mean, basis up to sign, eigenvalues, coefficients) is scikit-learn's full decomposition; the distance matrix, the
profile and its ranking are computed from scikit-learn's coefficients with NumPy. Prints a table and exits 1 when
anything differs by more than the tolerance: eigenvalues and profile number by number, everything else relative to the
norm of its row.

usage: compare_learning.py EIGENMARK [DATA]
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
from sklearn.decomposition import PCA

TOLERANCE = 1e-6

# Map below DATA (None for the built-in one), view size.
MAPS = [
    (None, 200),
    ("aerial/wellington.jpg", 200),
    ("aerial/nust.png", 140),
    ("aerial/kitsap.png", 125),
]

# Dimensions and further options: the Gram and the covariance route, every normalization. Every map runs the first two,
# the first two maps run all.
SETTINGS = [
    (15, []),
    (15, ["--normalize", "std", "--scale", "5"]),
    (15, ["--normalize", "mean", "--blur", "gauss3"]),
    (20, ["--stride", "40", "--blur", "none", "--highpass", "3"]),
    (50, ["--scale", "6", "--metric", "euclid"]),
]


def distances(g, metric):
    squared = np.square(g[:, None, :] - g[None, :, :]).sum(axis=2)
    if metric == "euclid":
        return np.sqrt(squared)
    energy = np.square(g).sum(axis=1)
    return squared / (2 * (energy[:, None] + energy[None, :]))


def difference(ours, theirs):
    """Largest difference relative to the norm of its row; single numbers for vectors."""
    assert ours.shape == theirs.shape, f"shape {ours.shape} instead of {theirs.shape}"
    assert np.isfinite(ours).all()
    if ours.ndim == 1:
        return (np.abs(ours - theirs) / np.abs(theirs)).max()
    return (np.abs(ours - theirs).max(axis=1) / np.linalg.norm(theirs, axis=1)).max()


def compare(binary, map_name, view_size, dims, options):
    with tempfile.TemporaryDirectory() as directory:
        directory = pathlib.Path(directory)
        command = [binary, "train", "--map", map_name, "--out", directory / "atlas", "--export", directory / "export"]
        command += ["--view-size", str(view_size), "--dims", str(dims), *options]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        files = {path.stem: np.load(path) for path in (directory / "export").glob("*.npy")}
        ranking = json.loads((directory / "export" / "ranking.json").read_text())["ranking"]

    views = files["views"]
    n = len(views)
    pca = PCA(n_components=dims, svd_solver="full").fit(views)
    signs = np.sign((pca.components_ * files["basis"]).sum(axis=1))
    g = pca.transform(views) * signs
    profile_of = distances(g, "euclid" if "euclid" in options else "nssd")
    profile = profile_of.sum(axis=1) / (n - 1)
    ours = files["profile"]
    found = {
        "mean": difference(files["mean"][None], pca.mean_[None]),
        "basis": difference(files["basis"], pca.components_ * signs[:, None]),
        "eigenvalues": difference(files["eigenvalues"], pca.explained_variance_ * (n - 1) / n),
        "coefficients": difference(files["coefficients"], g),
        "distances": difference(files["distances"], profile_of),
        "profile": difference(ours, profile),
    }
    expected = np.argsort(-ours, kind="stable") + 1
    # Views whose profiles differ by rounding only may change places.
    by_numpy = np.argsort(-profile, kind="stable")
    is_ranked = ranking == expected.tolist() and np.allclose(ours[by_numpy], np.sort(ours)[::-1], rtol=TOLERANCE)
    return n, found, is_ranked


def main():
    binary, *data = sys.argv[1:]
    failures = 0
    comparisons = 0
    for rank, (file, view_size) in enumerate(MAPS):
        if file is None:
            map_name = "builtin:city"
        elif data and (path := pathlib.Path(data[0]) / file).is_file():
            map_name = str(path)
        else:
            print(f"skipped: {file} is absent")
            failures += "EIGENMARK_REQUIRE_DATA" in os.environ
            continue
        for dims, options in SETTINGS if rank < 2 else SETTINGS[:2]:
            n, found, is_ranked = compare(binary, map_name, view_size, dims, options)
            is_equal = is_ranked and max(found.values()) <= TOLERANCE
            failures += not is_equal
            comparisons += is_equal
            name = pathlib.Path(map_name).name
            shown = "  ".join(f"{key} {value:.0e}" for key, value in found.items())
            verdict = "ok" if is_equal else "DIFFERENT"
            print(f"{name:16} {n:5} views  k = {dims:2} {' '.join(options):32} {shown}  {verdict}")
    print(f"{comparisons} passed, {failures} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
