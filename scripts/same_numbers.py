#!/usr/bin/env python3
"""Whether two builds of trueup do the same: each runs the same line with the same seeds, and every number of the run
folders, but for times of the clock on the wall, is compared bit for bit.

    python scripts/same_numbers.py BEFORE AFTER [--line 'pour(jar, cup)'] [--seeds 1-10]

A refactoring may change no number; what changes one on purpose says so in its commit.
"""

import argparse
import json
import pathlib
import subprocess
import sys
import tempfile

# Times of the wall's clock, where the run lies, and who made it.
ASIDE = {"timing_s", "run_dir", "version"}


def numbers(value, path=""):
    """Yields every leaf of a document with its path."""
    if isinstance(value, dict):
        for key in sorted(set(value) - ASIDE):
            yield from numbers(value[key], f"{path}.{key}")
    elif isinstance(value, list):
        for i, each in enumerate(value):
            yield from numbers(each, f"{path}[{i}]")
    else:
        yield path, value


def run(program, line, seed, folder):
    subprocess.run(
        [program, "-c", line, "--seed", str(seed), "--record", folder, "--quiet"],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False,
    )
    runs = sorted(pathlib.Path(folder).glob("*/run.json"))
    if not runs:
        sys.exit(f"{program}: seed {seed} left no run folder")
    return dict(numbers(json.loads(runs[-1].read_text()))), (runs[-1].parent / "arm.csv").read_text()


def main():
    args = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    args.add_argument("before")
    args.add_argument("after")
    args.add_argument("--line", default="pour(jar, cup)")
    args.add_argument("--seeds", default="1-10")
    args = args.parse_args()
    first, _, last = args.seeds.partition("-")
    worst = 0
    for seed in range(int(first), int(last or first) + 1):
        with tempfile.TemporaryDirectory() as a, tempfile.TemporaryDirectory() as b:
            (before, motion), (after, other) = run(args.before, args.line, seed, a), run(args.after, args.line, seed, b)
        keys = sorted(set(before) | set(after))
        differ = [key for key in keys if before.get(key) != after.get(key)]
        same_motion = "the same motion" if motion == other else "another motion"
        print(f"seed {seed}: {len(keys) - len(differ)} of {len(keys)} the same, {same_motion}")
        for key in differ[:5]:
            print(f"  {key}: {before.get(key)} -> {after.get(key)}")
        worst += len(differ) + (motion != other)
    sys.exit(1 if worst else 0)


if __name__ == "__main__":
    main()
