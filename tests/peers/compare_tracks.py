"""Compares the corners that `bench tracks` follows with OpenCV's, on the same frames of a flight.

Every corner is also followed from frame to frame by OpenCV's pyramidal Lucas-Kanade tracker, with a window and levels
like ours; the flight is known, so both are compared with the truth, too. New corners have to be where OpenCV's smaller
eigenvalue is large. Prints a table and exits 1 when corners differ, when ours are less accurate, or badly chosen.

usage: compare_tracks.py BENCH [DATA]
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile

import cv2
import numpy as np

# Pixels: the median distance of our corners from OpenCV's.
TOLERANCE_PX = 0.1

# Our median error may be larger than OpenCV's by this factor: both start where we say that a corner was in the frame
# before, but ours is followed from an older frame, so its error there counts, and OpenCV's does not.
MOST = 1.3

# Half of the new corners are among this share of the pixels with the largest eigenvalues, at least: they are to be apart
# from each other, not only good.
BEST = 0.35

# Map below DATA (None for the built-in one), view size.
MAPS = [
    (None, 200),
    ("aerial/wellington.jpg", 200),
    ("aerial/nust.png", 140),
    ("aerial/kitsap.png", 125),
]

FRAMES = 80

# An odd window next to our 12 pixels, and our three levels.
LUCAS_KANADE = {
    "winSize": (13, 13),
    "maxLevel": 2,
    "criteria": (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 30, 0.003),
}


def turned(points, heading):
    sin, cos = np.sin(heading), np.cos(heading)
    return points @ np.array([[cos, sin], [-sin, cos]])


def true_positions(points, before, after, side, view_size):
    """Where points of one frame are in another, by the poses of both."""
    scale = view_size / side
    ground = turned((points - side / 2) * scale * before["altitude_ratio"], before["heading_rad"]) + before["place"]
    relative = turned(ground - np.array(after["place"]), -after["heading_rad"])
    return relative / (scale * after["altitude_ratio"]) + side / 2


def compare(frames, flight, view_size):
    side = frames.shape[1]
    differences, ours, theirs, ranks = [], [], [], []
    for index, (frame, told) in enumerate(zip(frames, flight)):
        new = np.array([track["at"] for track in told["tracks"] if track["age"] == 0])
        if len(new):
            eigenvalues = cv2.cornerMinEigenVal(frame, 12, ksize=3)
            inner = np.sort(eigenvalues[8:-8, 8:-8], axis=None)
            found = eigenvalues[new[:, 1].astype(int), new[:, 0].astype(int)]
            ranks.extend(1 - np.searchsorted(inner, found) / inner.size)
        old = [track for track in told["tracks"] if track["age"] > 0]
        if index == 0 or not old:
            continue
        before, at = (np.array([track[key] for track in old], dtype=np.float32) for key in ("before", "at"))
        # OpenCV counts from the middle of the first pixel.
        peers, status, _ = cv2.calcOpticalFlowPyrLK(
            frames[index - 1], frame, (before - 0.5)[:, None], None, **LUCAS_KANADE
        )
        is_found = status[:, 0] == 1
        peers = peers[:, 0] + 0.5
        truth = true_positions(before.astype(float), flight[index - 1], told, side, view_size)
        differences.extend(np.linalg.norm(at - peers, axis=1)[is_found])
        ours.extend(np.linalg.norm(at - truth, axis=1)[is_found])
        theirs.extend(np.linalg.norm(peers - truth, axis=1)[is_found])
    return [float(np.median(values)) for values in (differences, ours, theirs, ranks)], len(differences)


def main():
    bench, *data = sys.argv[1:]
    failures = 0
    print("median pixels: corners  ours - OpenCV's  ours - truth  OpenCV's - truth  rank of new corners")
    with tempfile.TemporaryDirectory() as directory:
        out = pathlib.Path(directory) / "frames.npy"
        for file, view_size in MAPS:
            if file is None:
                map_name = "builtin:city"
            elif data and (path := pathlib.Path(data[0]) / file).is_file():
                map_name = str(path)
            else:
                print(f"skipped: {file} is absent")
                failures += "EIGENMARK_REQUIRE_DATA" in os.environ
                continue
            command = [bench, "tracks", map_name, str(view_size), str(FRAMES), str(out)]
            output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
            flight = json.loads(output)["result"]["flight"]
            (difference, ours, theirs, rank), corners = compare(np.load(out), flight, view_size)
            is_related = all(frame["related"] for frame in flight[1:])
            is_good = difference <= TOLERANCE_PX and ours <= MOST * theirs and rank <= BEST and is_related
            failures += not is_good
            name = pathlib.Path(map_name).stem
            print(
                f"{name:14} {corners:7} {difference:16.3f} {ours:13.3f} {theirs:17.3f} {100 * rank:19.1f} %"
                f"{'' if is_good else '  FAILED'}"
            )
    print(f"{failures} failures")
    sys.exit(failures > 0)


if __name__ == "__main__":
    main()
