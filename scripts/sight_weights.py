"""Fit how probable a placement is: rows of evidence -> weights of a logistic regression, and how well they do.

    cargo run --release --example sight_battery -- real --rows real.csv        (and `developed`, and others)
    python scripts/sight_weights.py real.csv developed.csv [--test held.csv]

Each row is one placement with what speaks for it and whether it was right. Clear and opaque things have weights of their
own, none negative, with a quadratic penalty. All that is printed of the fitted files is cross-validated: the rows of one
photograph or background, with all that was painted into it, are judged by weights that were fitted without them.
`--test` files have no part in any fit. Standard library only; no chance in it.
"""

import argparse
import csv
import math

SAYS = ["score", "weakest", "cut", "elsewhere", "shape", "gap", "whole", "agree"]
# Penalty of a weight's square: one placement's worth of doubt for each.
PENALTY = 1.0


def said(row):
    """What speaks for a placement, each growing with it; as in `alignment::vision::probability`."""
    within = lambda value, low, high: min(max(value, low), high)
    number = lambda name, none: float(row[name]) if row[name] else none
    return [
        number("score", 0.0),
        number("weakest", 0.0),
        2.0 * within(number("cut", 0.5), 0.5, 1.0) - 1.0,
        2.0 * within(number("elsewhere", 0.0), 0.0, 0.5),
        4.0 * within(number("shape", 0.0), -0.15, 0.1),
        within(number("gap", 0.0), 0.0, 0.3) / 0.3,
        -4.0 * number("missing", 0.0),
        math.exp(-number("apart", 1.0) / 0.02),
    ]


def group(picture):
    """The photograph or background that a picture is of: its rows are not independent of each other."""
    if " on " in picture:
        place = picture.split(" on ")[1]
        # Tables of our own are each another one.
        return picture if place.startswith("own") else place.split()[0]
    if picture.startswith("lab"):
        return picture.split("-")[0]
    return picture.split()[0]


def probability(weights, x):
    return 1.0 / (1.0 + math.exp(-max(-50.0, min(50.0, weights[0] + sum(w * v for w, v in zip(weights[1:], x))))))


def fit(rows):
    """Newton's steps on the penalised likelihood; a weight that would be negative is held at none."""
    n = len(SAYS) + 1
    free = list(range(n))
    while True:
        weights = [0.0] * n
        for _ in range(60):
            gradient = [0.0] * n
            hessian = [[0.0] * n for _ in range(n)]
            for x, y in rows:
                p = probability(weights, x)
                full = [1.0] + x
                for i in free:
                    gradient[i] += (y - p) * full[i]
                    for j in free:
                        hessian[i][j] += p * (1.0 - p) * full[i] * full[j]
            for i in free:
                if i > 0:
                    gradient[i] -= PENALTY * weights[i]
                    hessian[i][i] += PENALTY
                hessian[i][i] += 1e-6
            step = solve([[hessian[i][j] for j in free] for i in free], [gradient[i] for i in free])
            length = max(abs(s) for s in step)
            for i, s in zip(free, step):
                weights[i] += s * min(1.0, 2.0 / max(length, 1e-12))
            if length < 1e-8:
                break
        worst = min((i for i in free if i > 0), key=lambda i: weights[i], default=None)
        if worst is None or weights[worst] >= 0.0:
            return weights
        free.remove(worst)


def solve(a, b):
    n = len(b)
    a = [row[:] + [v] for row, v in zip(a, b)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(a[r][i]))
        a[i], a[pivot] = a[pivot], a[i]
        for r in range(n):
            if r != i:
                share = a[r][i] / a[i][i]
                a[r] = [x - share * y for x, y in zip(a[r], a[i])]
    return [a[i][n] / a[i][i] for i in range(n)]


def table(name, judged):
    """Prints how often what was said with how much probability was right."""
    found = [(p, y) for p, y in judged if p >= 0.5]
    right = sum(y for _, y in found)
    print(f"{name}: {len(judged)} placements, {sum(y for _, y in judged)} right;"
          f" found: {right} right, {len(found) - right} wrong")
    for low, high in [(0.0, 0.1), (0.1, 0.3), (0.3, 0.5), (0.5, 0.7), (0.7, 0.9), (0.9, 0.95), (0.95, 1.01)]:
        here = [(p, y) for p, y in judged if low <= p < high]
        if here:
            mean = sum(p for p, _ in here) / len(here)
            print(f"  said {low:.2f} to {min(high, 1.0):.2f} (mean {mean:.2f}): {sum(y for _, y in here)} of {len(here)} right")


def read(paths):
    rows = []
    for path in paths:
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                # What is off the table, or explained by something else, is decided without a probability.
                if float(row["confidence"]) == 0.0:
                    continue
                rows.append((int(row["is_clear"]), group(row["picture"]), said(row), int(row["is_right"])))
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("fitted", nargs="+")
    parser.add_argument("--test", nargs="*", default=[])
    arguments = parser.parse_args()
    rows, test = read(arguments.fitted), read(arguments.test)
    crossed, tested = [], []
    for kind, name in enumerate(["opaque", "clear"]):
        own = [row for row in rows if row[0] == kind]
        groups = sorted({row[1] for row in own})
        judged = []
        for left_out in groups:
            weights = fit([(x, y) for _, g, x, y in own if g != left_out])
            judged += [(probability(weights, x), y) for _, g, x, y in own if g == left_out]
        weights = fit([(x, y) for _, _, x, y in own])
        print(f"{name}: offset {weights[0]:.2f}, "
              + ", ".join(f"{s} {w:.2f}" for s, w in zip(SAYS, weights[1:])))
        table(f"  {name}, {len(groups)} groups, each left out in turn", judged)
        crossed += judged
        tested += [(probability(weights, x), y) for k, _, x, y in test if k == kind]
    table("all, each group left out in turn", crossed)
    if test:
        table("not fitted", tested)


if __name__ == "__main__":
    main()
