#!/usr/bin/env python3
"""How long motions along the same curves take at least where jerk is limited too: a bound for ours, found by optimisation.

    cargo run --release --example timed_paths paths.jsonl 40
    pip install casadi numpy; python benches/peers/jerk_bound.py paths.jsonl [EVERY]

TOPP-RA knows no jerk, and the problem with jerk is not convex: what is found here is a local optimum of IPOPT on the same curve
(straight edges, Bezier curves of degree 5 at corners), with limits looked at where its stretches of constant jerk meet: 32 in a
corner; on an edge the seven of a double S, their times free. EVERY leaves out paths: of every so many one is tried.
"""
import collections, json, statistics, sys

import casadi as ca
import numpy as np

CORNER, EDGE = 32, 7


def bend(u):
    """Of both legs of a rounded corner: three derivatives by u, as in `src/motion/curve.rs`."""
    second = lambda u: (2.5 * u**3 * (4 - 3 * u), 30 * u**2 * (1 - u), u * (60 - 90 * u))
    a, b = second(1 - u), second(u)
    return (a[0], -a[1], a[2]), b


def pieces(path, cut):
    """Stretches of a curve: (length, leg before, leg after or None)."""
    found, at = [], path[0]
    for i in range(1, len(path)):
        edge = np.linalg.norm(path[i] - path[i - 1])
        own = 0.0
        if i + 1 < len(path):
            after = np.linalg.norm(path[i + 1] - path[i])
            own = min(0.5 * edge, 0.5 * after, cut)
        to = path[i] + (path[i - 1] - path[i]) * own / edge
        straight = np.linalg.norm(to - at)
        if straight > 1e-12:
            found.append((straight, to - at, None))
        at = to
        if own > 0:
            to = path[i] + (path[i + 1] - path[i]) * own / after
            found.append((2.5 * own, path[i] - at, to - path[i]))
            at = to
    return found


def least(path, cut, velocity, acceleration, jerk):
    """Duration (s) of the fastest motion found, or None."""
    opti = ca.Opti()
    total, state = 0, (ca.DM(0), ca.DM(0))
    stretches = pieces(path, cut)
    ends = []
    for k, (length, before, after) in enumerate(stretches):
        n = EDGE if after is None else CORNER
        s, v, a = opti.variable(n + 1), opti.variable(n + 1), opti.variable(n + 1)
        if after is None:
            jm = min(jerk / np.maximum(abs(before / length), 1e-12))
            j = ca.DM([jm, 0, -jm, 0, -jm, 0, jm])
        else:
            j = opti.variable(n)
        h = opti.variable(n if after is None else 1)
        opti.subject_to(h >= 0)
        hs = h if after is None else ca.repmat(h, n, 1)
        total += ca.sum1(hs)
        opti.subject_to([s[0] == 0, s[n] == length, v >= 0])
        if k == 0:
            opti.subject_to([v[0] == 0, a[0] == 0])
        else:
            opti.subject_to([v[0] == state[0], a[0] == state[1]])
        state = (v[n], a[n])
        s0, v0, a0 = s[:n], v[:n], a[:n]
        opti.subject_to(s[1:] == s0 + hs * (v0 + hs * (a0 / 2 + hs * j / 6)))
        opti.subject_to(v[1:] == v0 + hs * (a0 + hs * j / 2))
        opti.subject_to(a[1:] == a0 + hs * j)
        slow = 0.3
        opti.set_initial(s, np.linspace(0, length, n + 1))
        opti.set_initial(v, slow)
        opti.set_initial(h, length / slow / n)
        if after is None:
            dq = before / length
            vm = min(velocity / np.maximum(abs(dq), 1e-12))
            am = min(acceleration / np.maximum(abs(dq), 1e-12))
            opti.subject_to(v <= vm)
            opti.subject_to([opti.bounded(-am, a, am), a[3] == 0])
        else:
            u = s / length
            (a1, a2, a3), (b1, b2, b3) = bend(u)
            for i in range(len(before)):
                d = (a1 * before[i] + b1 * after[i]) / length
                dd = (a2 * before[i] + b2 * after[i]) / length**2
                ddd = (a3 * before[i] + b3 * after[i]) / length**3
                opti.subject_to(opti.bounded(-1, d * v / velocity[i], 1))
                opti.subject_to(opti.bounded(-1, (d * a + dd * v**2) / acceleration[i], 1))
                rest = 3 * dd * v * a + ddd * v**3
                for side in (slice(0, n), slice(1, n + 1)):
                    opti.subject_to(opti.bounded(-1, (d[side] * j + rest[side]) / jerk[i], 1))
    opti.subject_to([state[0] == 0, state[1] == 0])
    opti.minimize(total)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "max_iter": 2000, "tol": 1e-6})
    try:
        opti.solve()
    except RuntimeError:
        return None
    return float(opti.value(total))


def main():
    every = int(sys.argv[2]) if len(sys.argv) > 2 else 1
    kinds, counts = collections.defaultdict(list), collections.Counter()
    for line in open(sys.argv[1]):
        given = json.loads(line)
        corners = given["corners"]
        counts[corners] += 1
        if (counts[corners] - 1) % every:
            continue
        path, *limits = (np.array(given[name]) for name in ("path", "velocity", "acceleration", "jerk"))
        bound = least(path, given["cut"], *limits)
        if bound is None:
            print(f"not solved: a path of {corners} corners")
            continue
        kinds[corners].append((given["duration_s"], bound))
        if "-v" in sys.argv:
            print(corners, counts[corners] - 1, given["duration_s"], bound, flush=True)
    print("corners  paths  ours, s  least, s  longer by, mean  most")
    for corners, rows in sorted(kinds.items()):
        ours, bound = (statistics.mean(column) for column in zip(*rows))
        most = max(ours / bound for ours, bound in rows)
        print(f"{corners:7} {len(rows):6} {ours:8.3f} {bound:9.3f} {100 * (ours / bound - 1):14.1f} % {100 * (most - 1):5.1f} %")


if __name__ == "__main__":
    main()
