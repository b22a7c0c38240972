#!/usr/bin/env python3
"""How long motions along the same paths take, timed by us with jerk limits and by TOPP-RA without.

    cargo run --release --example timed_paths paths.jsonl 40
    pip install toppra; python benches/peers/toppra_times.py paths.jsonl

TOPP-RA gets each path as a spline through points 2 mrad apart, and the same limits of speed and acceleration. It knows no jerk, so
its duration is a bound that no motion with a jerk limit reaches. Times to compute are of its solver alone.
"""
import collections, json, statistics, sys, time

import numpy as np
import toppra
import toppra.algorithm
import toppra.constraint

toppra.setup_logging("ERROR")


def timed(samples, velocity, acceleration):
    """Duration (s) and time to compute (µs) of a path through samples."""
    points = [samples[0]]
    for sample in samples[1:]:
        if np.linalg.norm(sample - points[-1]) > 2e-3:
            points.append(sample)
    points[-1] = samples[-1]
    points = np.array(points)
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    path = toppra.SplineInterpolator(along, points)
    limits = [
        toppra.constraint.JointVelocityConstraint(np.stack([-velocity, velocity], axis=1)),
        toppra.constraint.JointAccelerationConstraint(np.stack([-acceleration, acceleration], axis=1)),
    ]
    # As many gridpoints as it needs for a stretch of a hundredth of a radian.
    grid = np.linspace(0.0, along[-1], max(100, int(along[-1] / 0.01)))
    solver = toppra.algorithm.TOPPRA(limits, path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
    begin = time.perf_counter()
    found = solver.compute_trajectory(0, 0)
    took = 1e6 * (time.perf_counter() - begin)
    return (None if found is None else found.duration), took


def main():
    kinds = collections.defaultdict(list)
    for line in open(sys.argv[1]):
        path = json.loads(line)
        arrays = [np.array(path[name]) for name in ("samples", "velocity", "acceleration")]
        bound, took = timed(*arrays)
        if bound is None:
            print(f"not solved by TOPP-RA: a path of {path['corners']} corners")
            continue
        kinds[path["corners"]].append((path["duration_s"], bound, path["time_us"], took))
    print("corners  paths  ours, s  TOPP-RA, s  longer by  ours, us  TOPP-RA, us")
    for corners, rows in sorted(kinds.items()):
        ours, bound, us, took = (statistics.mean(column) for column in zip(*rows))
        us, took = (statistics.median(column) for column in list(zip(*rows))[2:])
        print(f"{corners:7} {len(rows):6} {ours:8.3f} {bound:11.3f} {100 * (ours / bound - 1):8.1f} % {us:9.0f} {took:12.0f}")


if __name__ == "__main__":
    main()
