"""Times learning, selection and dense projection against scikit-learn, NumPy and SciPy, on the same data in the same run.

The vectors are candidates of a real map. Each side is a process of its own that reads them, computes a few times, and
prints its best time, its peak memory and a result; the two take turns. Results are compared, and then times. Prints a
line per row of the table and, with a third argument, writes them there as a Markdown table with their provenance. Exits
1 when results differ or a ratio is above its limit.

At the end the whole command line trains an atlas from 100,541 views, by every ranking, and evaluates one of 83 landmarks.

usage: benchmark.py BENCH MAP [TABLE] [--quick]
"""

import hashlib
import json
import os
import pathlib
import platform
import subprocess
import sys
import tempfile
import time

import numpy as np

# Rounds of taking turns, and repetitions within one.
ROUNDS = 3
REPETITIONS = 3

# Eigenvalues may differ by this much, relative to the largest: rounding of sums; what sums in single precision lose;
# and what scikit-learn leaves to chance where it takes a random sketch.
TOLERANCE = {"f64": 1e-10, "f32": 1e-3, "randomized": 0.02, "dense": 1e-9}

# One in so many dots of a dense projection is compared.
DOTS = 997

# Ways to call fftconvolve: kernel by kernel, or all at once, which shares the map's spectrum; and with how many workers.
CONVOLUTIONS = [(how, workers) for how in ("loop", "batch") for workers in (1, os.cpu_count())]

# Rows of a block of pairs: 1000 x 100,000 doubles are 800 MB.
PAIRS = 1000


# Candidates for the many: about 100,000 views of 20 x 20 pixels on a map of 1600 x 1200.
MANY = {"view_px": 120, "scale": 6, "stride_px": 4}

# What training so many may take, with ranking and everything else.
MAX_TRAINING_USER_S = 10
MAX_TRAINING_MIB = 4096

# How it ranks.
RANKINGS = ["profile", "ipca", "reliable"]

# What is evaluated of 83 landmarks at scale 1/10, and the user time it may take, in seconds.
EVALUATIONS = {
    "orientation, altitude, gamma and catchment, through the core": (["--report-only", "--views", 0, "--through", "core"], 30),
    "the same, and in f64": (["--report-only", "--views", 0], None),
    "the same, with a score of 400 views each": (["--report-only"], None),
    "all measures, score, through the core and in f64": ([], None),
}


# -- what the peers do --------------------------------------------------------------------------------------------


def pca(path, dtype):
    from sklearn.decomposition import PCA

    vectors = np.load(path).astype(dtype)

    def learn():
        model = PCA(15, random_state=0)
        model.fit_transform(vectors)
        count = len(vectors)
        is_sketched = model._fit_svd_solver == "randomized"
        learn.kind = "randomized" if is_sketched else np.dtype(dtype).name.replace("float", "f")
        return (model.explained_variance_ * (count - 1) / count).tolist()

    return learn


def profile(path):
    points = np.load(path)
    norms = np.square(points).sum(axis=1)

    def rank():
        values = np.empty(len(points))
        for start in range(0, len(points), PAIRS):
            block = slice(start, start + PAIRS)
            sums = norms[block, None] + norms[None, :]
            values[block] = (0.5 - points[block] @ points.T / sums).sum(axis=1)
        return (np.argsort(-values, kind="stable")[:50] + 1).tolist()

    return rank


def ipca(path, landmarks):
    vectors = np.load(path).astype(np.float64)

    def rank():
        # Algorithm 2.4 with every candidate at once. The basis of the eigenspace may be any orthonormal one: residuals
        # do not depend on it, so the eigenproblem of the update is left out, in the peer's favor.
        selected = [0, 1, 2]
        start = vectors[selected]
        mean = start.mean(axis=0)
        basis = np.linalg.svd(start - mean, full_matrices=False)[2][:2]
        while len(selected) < landmarks:
            centered = vectors - mean
            coordinates = centered @ basis.T
            residuals = coordinates @ basis - centered
            norms = np.einsum("ij,ij->i", residuals, residuals)
            norms[selected] = -1
            best = int(norms.argmax())
            direction = residuals[best] / np.sqrt(norms[best])
            basis = np.vstack([basis, direction])
            count = len(selected)
            mean = (count * mean + vectors[best]) / (count + 1)
            selected.append(best)
        return [index + 1 for index in selected]

    return rank


def dense(path, eigenimages, how, workers):
    import scipy.fft
    from scipy.signal import fftconvolve

    pixels = np.load(path)
    kernels = np.load(eigenimages)
    side = round(kernels.shape[1] ** 0.5)
    kernels = kernels.reshape(-1, side, side)[:, ::-1, ::-1]

    def project():
        with scipy.fft.set_workers(int(workers)):
            if how == "loop":
                return [fftconvolve(pixels, kernel, mode="valid") for kernel in kernels]
            return fftconvolve(pixels[None], kernels, mode="valid", axes=(1, 2))

    def summarize(planes):
        dots = np.ravel(planes)
        sizes = np.abs(dots)
        return [sizes.max(), sizes.mean(), *dots[::DOTS].tolist()]

    project.summarize = summarize
    project.kind = "dense"
    return project


def peer(what, path, *more):
    """In a process of its own: the best time, the peak memory, the result."""
    import resource

    compute = {
        "pca-f32": lambda: pca(path, np.float32),
        "pca-f64": lambda: pca(path, np.float64),
        "profile": lambda: profile(path),
        "ipca": lambda: ipca(path, int(more[1])),
        "dense": lambda: dense(path, *more[1:]),
    }[what]()
    repetitions = int(more[0])
    seconds = []
    result = None
    for _ in range(repetitions):
        del result
        begin = time.perf_counter()
        result = compute()
        seconds.append(time.perf_counter() - begin)
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    result = getattr(compute, "summarize", lambda result: result)(result)
    kind = getattr(compute, "kind", None)
    print(json.dumps({"seconds": min(seconds), "peak_mib": peak_mib, "result": result, "kind": kind}))


# -- taking turns -------------------------------------------------------------------------------------------------


def run(command):
    output = subprocess.run([str(part) for part in command], check=True, capture_output=True, text=True)
    return json.loads(output.stdout)


def measure(ours, theirs, rounds):
    """The better of `rounds` times of each side, taken in turns."""
    best = None
    for _ in range(rounds):
        now = [run(ours), run(theirs)]
        if best is None:
            best = now
        for old, new in zip(best, now):
            old["seconds"] = min(old["seconds"], new["seconds"])
            old["peak_mib"] = max(old["peak_mib"], new["peak_mib"])
    return best


def difference(ours, theirs):
    """Of eigenvalues and dots, relative to the largest; of rankings, whether there is any."""
    if isinstance(ours[0], int):
        return float(ours != theirs)
    return np.abs(np.subtract(ours, theirs)).max() / ours[0]


def main():
    arguments = [argument for argument in sys.argv[1:] if argument != "--quick"]
    is_quick = "--quick" in sys.argv
    bench, map_path, *table = arguments
    rounds = 1 if is_quick else ROUNDS
    this = [sys.executable, __file__, "--peer"]
    rows = []
    failures = 0
    with tempfile.TemporaryDirectory() as directory:
        directory = pathlib.Path(directory)

        def candidates(name, every, view_px, scale, stride_px):
            path = directory / f"{name}.npy"
            command = [bench, "candidates", map_path, view_px, scale, stride_px, every, path]
            run(command)
            return path

        many = candidates("many", 20 if is_quick else 1, **MANY)
        some = candidates("some", 100 if is_quick else 5, **MANY)
        report = candidates("report", 1, 200, 10, 0)
        fine = candidates("fine", 1, 200, 4 if is_quick else 1, 0)
        coordinates = directory / "coordinates.npy"
        run([bench, "coordinates", many, coordinates])

        def compare(name, limit, ours, theirs, rounds=rounds, repetitions=REPETITIONS):
            nonlocal failures
            what, path, *more = ours
            our = [bench, what, path, repetitions, *more]
            what, path, *more = theirs
            their = [*([bench] if what == "ipca-literal" else this), what, path, repetitions, *more]
            our, their = measure(our, their, rounds)
            ratio = our["seconds"] / their["seconds"]
            differs = difference(our["result"], their["result"])
            is_same = differs <= TOLERANCE.get(their.get("kind"), 0)
            # Of few vectors, and without optimization, time says nothing.
            is_met = is_quick or limit is None or ratio <= limit
            failures += not (is_same and is_met)
            shape = "{0} x {1}".format(*np.load(path, mmap_mode="r").shape)
            verdict = "ok" if is_same and is_met else "TOO SLOW" if is_same else "DIFFERENT RESULTS"
            seconds = our["seconds"], their["seconds"]
            rows.append((name, shape, *seconds, ratio, limit, differs, our["peak_mib"], their["peak_mib"]))
            print(f"{name:38} {shape:14} {seconds[0]:9.4f} s {seconds[1]:9.4f} s  ratio {ratio:.4f} (limit {limit})  "
                  f"differ by {differs:.0e}  {our['peak_mib']:5.0f} MiB {their['peak_mib']:5.0f} MiB  {verdict}",
                  flush=True)

        for path in (report, fine, many):
            compare("PCA, k = 15; scikit-learn, f64", 1.0, ("pca", path), ("pca-f64", path))
            # Sums in single precision are another result: for information.
            compare("PCA, k = 15; scikit-learn, f32", None, ("pca", path), ("pca-f32", path))
        compare("profile, nSSD; NumPy, pairs in blocks", 0.005, ("profile", coordinates),
                ("profile", coordinates), 1, 1)
        landmarks = 10 if is_quick else 50
        compare(f"IPCA, {landmarks} landmarks; NumPy, literal", 0.02, ("ipca", some, landmarks),
                ("ipca", some, landmarks))
        # In blocks and on all cores, too: for information.
        compare(f"IPCA, {landmarks} landmarks; our literal route", None, ("ipca", some, landmarks),
                ("ipca-literal", some, landmarks))

        pixels = directory / "pixels.npy"
        run([bench, "luminance", map_path, pixels])
        windows = fine
        if is_quick:
            np.save(pixels, np.load(pixels)[:190, :240])
            windows = candidates("small", 1, 40, 1, 0)
        eigenimages = directory / "eigenimages.npy"
        run([bench, "eigenimages", windows, eigenimages])
        called = fastest([*this, "dense", pixels], eigenimages)
        count, length = np.load(eigenimages, mmap_mode="r").shape
        side = round(length**0.5)
        compare(f"dense, {count} of {side} x {side}; SciPy, {called[0]}, {called[1]} workers", 0.5,
                ("dense", pixels, eigenimages), ("dense", pixels, eigenimages, *called))

        trainings, evaluations = [], []
        eigenmark, atlas = pathlib.Path(bench).with_name("eigenmark"), directory / "atlas"
        for ranking in [] if is_quick else RANKINGS:
            training = train(eigenmark, map_path, ranking, atlas)
            is_met = training[0] <= MAX_TRAINING_USER_S and training[2] <= MAX_TRAINING_MIB
            failures += not is_met
            trainings.append((ranking, *training))
            verdict = "ok" if is_met else "TOO MUCH"
            print("train, {0}: {1:.1f} s user, {2:.1f} s, {3:.0f} MiB ".format(*trainings[-1]), verdict)
        if not is_quick:
            whole([eigenmark, "train", "--map", map_path, "--out", atlas, "--select", "all"])
        for name, (options, most) in {} if is_quick else EVALUATIONS.items():
            evaluation = whole([eigenmark, "evaluate", "--map", map_path, "--atlas", atlas, *options])
            is_met = most is None or evaluation[0] <= most
            failures += not is_met
            evaluations.append((name, most, *evaluation))
            verdict = "ok" if is_met else "TOO MUCH"
            print("evaluate, {0}: {2:.1f} s user, {3:.1f} s, {4:.0f} MiB ".format(*evaluations[-1]), verdict)

    if table:
        write(table[0], rows, trainings, evaluations, map_path)
    return 1 if failures else 0


def fastest(command, eigenimages):
    """The fastest way to call fftconvolve."""
    seconds = {called: run([*command, 2, eigenimages, *called])["seconds"] for called in CONVOLUTIONS}
    for (how, workers), taken in seconds.items():
        print(f"fftconvolve, {how}, {workers} workers: {taken:.4f} s")
    return min(seconds, key=seconds.get)


def train(binary, map_path, ranking, atlas):
    command = [binary, "train", "--map", map_path, "--out", atlas, "--select", ranking]
    command += ["--view-size", MANY["view_px"], "--scale", MANY["scale"], "--stride", MANY["stride_px"]]
    return whole(command)


def whole(command):
    """User time and wall time in seconds, and peak memory in MiB, of a whole command."""
    begin = time.perf_counter()
    process = subprocess.Popen([str(part) for part in command], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    assert status == 0, f"{command} failed"
    return usage.ru_utime, time.perf_counter() - begin, usage.ru_maxrss / 1024


def write(path, rows, trainings, evaluations, map_path):
    import scipy
    import sklearn

    digest = hashlib.sha256(pathlib.Path(map_path).read_bytes()).hexdigest()[:16]
    rustc = subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True).stdout.split()[1]
    lines = [
        "# Learning, selection and dense projection, timed against scikit-learn, NumPy and SciPy",
        "",
        f"`tests/benchmark` on {pathlib.Path(map_path).name} (SHA-256 {digest}…); rustc {rustc}, scikit-learn",
        f"{sklearn.__version__}, NumPy {np.__version__}, SciPy {scipy.__version__}; {processor()}, {os.cpu_count()} cores.",
        f"Best of {ROUNDS} rounds of {REPETITIONS}, in turns (profile: once). Vectors are gauss1 views: 83 of the report's layout at scales 1/10",
        "and 1, the others of {view_px} map pixels at scale 1/{scale}, {stride_px} apart, all or every fifth."
        .format(**MANY),
        "Dense projection multiplies 15 eigenimages with the window at every position, in double precision; SciPy's",
        "`fftconvolve` is called in the fastest of four ways.",
        "Eigenvalues and dots differ relative to the largest; rankings are equal. Memory is the peak of the process, its input",
        "included; Python's includes its libraries.",
        "",
        "| row | data | ours, s | theirs, s | ratio | limit | results differ by | our memory, MiB | theirs, MiB |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, shape, ours, theirs, ratio, limit, differs, our_mib, their_mib in rows:
        cells = [name, shape.replace("x", "×"), f"{ours:.4f}", f"{theirs:.4f}", f"{ratio:.4f}"]
        cells += ["–" if limit is None else str(limit), f"{differs:.0e}" if differs else "–"]
        cells += [f"{our_mib:.0f}", f"{their_mib:.0f}"]
        lines.append("| " + " | ".join(cells) + " |")
    lines += [
        "",
        "`eigenmark train --view-size {view_px} --scale {scale} --stride {stride_px}`, from the map to the atlas, with"
        .format(**MANY),
        "projection, ranking, quantization and calibration:",
        "",
        "| `--select` | user, s | wall, s | memory, MiB |",
        "| --- | --- | --- | --- |",
    ]
    for ranking, user, wall, mib in trainings:
        lines.append(f"| {ranking} | {user:.1f} | {wall:.1f} | {mib:.0f} |")
    lines += [
        "",
        "`eigenmark evaluate` of the 83 views of the report's layout as landmarks, with the defaults:",
        "",
        "| what | user, s | limit | wall, s | memory, MiB |",
        "| --- | --- | --- | --- | --- |",
    ]
    for name, most, user, wall, mib in evaluations:
        lines.append(f"| {name} | {user:.1f} | {'–' if most is None else most} | {wall:.1f} | {mib:.0f} |")
    pathlib.Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")


def processor():
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return platform.processor()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--peer"]:
        peer(*sys.argv[2:])
    else:
        sys.exit(main())
