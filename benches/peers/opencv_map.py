"""Times OpenCV's homography on pairs of which three in ten are wrong, the same kind that `benches/map.rs` makes.

    python benches/peers/opencv_map.py

Needs `opencv-python-headless` and `numpy`. Each method is told the threshold that is best for it here (three standard
deviations of the noise); `trueup` is told none.
"""

import time

import cv2
import numpy as np

TRUTH = np.array([[0.92, -0.08, 60.0], [0.11, 0.95, -35.0], [1.5e-4, -9e-5, 1.0]])
NOISE = 0.5


def apply(m, points):
    homogeneous = np.c_[points, np.ones(len(points))] @ m.T
    return homogeneous[:, :2] / homogeneous[:, 2:]


def planted(n, seed):
    rng = np.random.default_rng(seed)
    twin = rng.uniform([0, 0], [1000, 800], (n, 2))
    real = apply(TRUTH, twin) + NOISE * rng.standard_normal((n, 2))
    wrong = np.arange(n) % 10 < 3
    real[wrong] = rng.uniform([0, 0], [1000, 800], (wrong.sum(), 2))
    return twin, real


GRID = np.array([[125.0 * i, 100.0 * j] for i in range(9) for j in range(9)])


def error(m):
    return np.sqrt(np.mean(np.sum((apply(m, GRID) - apply(TRUTH, GRID)) ** 2, axis=1)))


cv2.setNumThreads(1)
print("cv2", cv2.__version__)
for n, seeds in [(20, 200), (1000, 100), (100_000, 5)]:
    sets = [planted(n, seed) for seed in range(seeds)]
    # cv2 5.0.0 ends with a segmentation fault in USAC_ACCURATE on 100,000 pairs.
    names = ["RANSAC", "USAC_DEFAULT", "USAC_ACCURATE", "USAC_MAGSAC"]
    for name in names if n < 100_000 else ["RANSAC", "USAC_DEFAULT", "USAC_MAGSAC"]:
        method = getattr(cv2, name)
        errors, times = [], []
        for twin, real in sets:
            begin = time.perf_counter()
            m, _ = cv2.findHomography(twin, real, method, 3 * NOISE, maxIters=3000, confidence=0.9999999)
            times.append(time.perf_counter() - begin)
            errors.append(error(m))
        low, middle, high = np.percentile(times, [5, 50, 95]) * 1e3
        print(f"{n} pairs, {name}: {np.median(errors):.4f} px, {middle:.3f} ms ({low:.3f} to {high:.3f})")
