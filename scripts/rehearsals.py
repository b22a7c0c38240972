#!/usr/bin/env python3
"""How often a task succeeds, against the number of plans that are tried in the twin before the arm moves.

    python scripts/rehearsals.py --seeds 1-5 --candidates 1,2,4,8 --out rehearsals --svg docs/rehearsals.svg

Each line of CASES is run with every number of candidates on the same seeds. A run counts when its own record says `success`. Bars
in the figure are Wilson intervals at 95 %.
"""
import argparse, json, math, pathlib, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
# Name, arguments: one harder table, and the kitchen with a hidden error that the calibration is kept from correcting.
CASES = [
    ("a can pushed beside a tin", ["--scene", str(ROOT / "tests/tables/cans.task"), "-c", "push_to(can, tin)"]),
    ("pour, arm offset not corrected", ["-c", "pour(jar, cup)", "--without-regression", "3"]),
]


def wilson(good, n, z=1.96):
    """The interval of a share, both ends."""
    p, d = good / n, 1 + z * z / n
    middle, half = (p + z * z / (2 * n)) / d, z / d * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return middle - half, middle + half


def one(trueup, arguments, candidates, seed, out):
    """The outcome of one run, which of its plans succeeded in the twin, and why it failed."""
    runs = out / f"{candidates}-{seed}"
    done = subprocess.run([trueup, *arguments, "--candidates", str(candidates), "--seed", str(seed), "--record", runs, "--quiet"],
                          capture_output=True, text=True)
    folders = sorted(runs.iterdir()) if runs.exists() else []
    if not folders:
        return "refused", [], (done.stderr.strip().splitlines() or ["?"])[0]
    record = json.loads((folders[0] / "run.json").read_text())
    tried = [rehearsal["success"] for rehearsal in record.get("rehearsals", [])]
    return record["outcome"], tried, record.get("reason") or ""


def figure(rows, counts, path):
    """An SVG: success over the number of candidates, a line for each case."""
    width, height, left, bottom = 640, 300, 60, 250
    colours = ["#2050c0", "#c05020", "#208040"]
    x = lambda k: left + 40 + k * (width - left - 120) / max(len(counts) - 1, 1)
    y = lambda share: bottom - 200 * share
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="12">',
             f'<rect width="{width}" height="{height}" fill="white"/>']
    for tick in range(0, 101, 25):
        parts.append(f'<line x1="{left}" x2="{width - 20}" y1="{y(tick / 100)}" y2="{y(tick / 100)}" stroke="#ddd"/>'
                     f'<text x="{left - 8}" y="{y(tick / 100) + 4}" text-anchor="end">{tick} %</text>')
    for k, count in enumerate(counts):
        parts.append(f'<text x="{x(k)}" y="{bottom + 18}" text-anchor="middle">{count}</text>')
    parts.append(f'<text x="{(left + width) / 2}" y="{bottom + 38}" text-anchor="middle">plans tried in the twin at most</text>')
    for c, (name, cells) in enumerate(rows):
        shift = 5 * (2 * c - len(rows) + 1)
        points = [(x(k) + shift, good / n, wilson(good, n)) for k, (good, n) in enumerate(cells)]
        line = " ".join(f"{px},{y(share)}" for px, share, _ in points)
        parts.append(f'<polyline points="{line}" fill="none" stroke="{colours[c]}"/>')
        for px, share, (low, high) in points:
            parts.append(f'<line x1="{px}" x2="{px}" y1="{y(low)}" y2="{y(high)}" stroke="{colours[c]}"/>'
                         f'<circle cx="{px}" cy="{y(share)}" r="4" fill="{colours[c]}"/>')
        parts.append(f'<text x="{left + 10}" y="{20 + 16 * c}" fill="{colours[c]}">{name} (n = {cells[0][1]})</text>')
    path.write_text("\n".join(parts) + "\n</svg>\n")


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("--trueup", default=str(ROOT / "target/release/trueup"))
    args.add_argument("--seeds", default="1-5")
    args.add_argument("--candidates", default="1,2,4,8")
    args.add_argument("--cases", default="", help="only cases whose name has this in it")
    args.add_argument("--out", type=pathlib.Path, default=pathlib.Path("rehearsals"))
    args.add_argument("--svg", type=pathlib.Path)
    args = args.parse_args()
    first, _, last = args.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    counts = [int(count) for count in args.candidates.split(",")]
    rows = []
    for case, (name, arguments) in enumerate(CASES):
        if args.cases not in name:
            continue
        cells = []
        for count in counts:
            folder = args.out / str(case)
            folder.mkdir(parents=True, exist_ok=True)
            results = [one(args.trueup, arguments, count, seed, folder) for seed in seeds]
            good = sum(outcome == "success" for outcome, _, _ in results)
            cells.append((good, len(results)))
            print(f"{name}: {count} candidates: {good} of {len(results)}", flush=True)
            for seed, (outcome, tried, why) in zip(seeds, results):
                print(f"    seed {seed}: {outcome}, {sum(tried)} of {len(tried)} plans succeeded in the twin: {why[:150]}", flush=True)
        rows.append((name, cells))
    if args.svg:
        figure(rows, counts, args.svg)
    return 0


if __name__ == "__main__":
    sys.exit(main())
