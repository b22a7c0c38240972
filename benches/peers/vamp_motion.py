#!/usr/bin/env python3
"""VAMP on the problems of MotionBenchMaker for the Panda, to be run beside `examples/panda_problems.rs`.

    pip download vamp-planner --no-deps --no-binary :all:    # its sources; Eigen 3, and beside it in one folder:
                                                             # kavrakilab/nigh, orlp/pdqsort, lemire/SIMDxorshift
    g++ -std=c++17 -O3 -DNDEBUG -march=native -mavx2 -fno-math-errno -fno-signed-zeros -fno-trapping-math \
        -fno-rounding-math -ffp-contract=fast -fassociative-math -flto=auto -w -I VAMP/src/impl -I /usr/include/eigen3 \
        -I nigh/src -I pdqsort -I SIMDxorshift/include benches/peers/vamp_motion.cc -o vamp_motion
    python benches/peers/vamp_motion.py ./vamp_motion DATA [RUNS]

The flags are VAMP's own. Its numbers are a Halton sequence from its beginning, so a problem has one answer; other stretches of
the sequence are other seeds. Robot, capsules for cylinders (boxes in the set `box`), range 1 rad: as VAMP publishes its results.
Times are the least of RUNS (default 3) for search and simplification, without a proof that edges are free.
"""
import json, pathlib, statistics, subprocess, sys, tempfile

STRETCHES = [0, 100, 200, 300, 1000, 5000]
# Its goal is in collision.
LEFT_OUT = ("table_pick", "41")


def problem(name, posed):
    """What `vamp_motion` reads of a problem."""
    lines = [f"{name} {posed['index']} {len(posed['obstacles'])}"]
    lines += [" ".join(map(str, posed[end])) for end in ("start", "goal")]
    for thing in posed["obstacles"]:
        if thing["type"] == "box":
            form, sizes = "box", thing["half_extents"]
        else:
            radius, half = thing["radius"], thing["length"] / 2
            form, sizes = ("box", [radius, radius, half]) if name == "box" else ("capsule", [radius, half, 0.0])
        lines.append(" ".join(map(str, [form, *thing["pos"], *thing["quat_xyzw"], *sizes])))
    return "\n".join(lines)


def row(name, rows):
    """Medians of a set: planned and simplified, then planned alone (ms), what 95 % are below, and length (rad)."""
    below = lambda list, share: sorted(list)[int(share * len(list))]
    times = {"whole": [(float(r[2]) + float(r[3])) / 1e3 for r in rows], "search": [float(r[2]) / 1e3 for r in rows]}
    shown = [f"{below(list, 0.5):9.3f} {below(list, 0.95):7.3f}" for list in times.values()]
    return f"{name:18} {len(rows):5} {' '.join(shown)} {statistics.median(float(r[4]) for r in rows):8.2f}"


def main():
    program, data = sys.argv[1], pathlib.Path(sys.argv[2])
    runs = sys.argv[3] if len(sys.argv) > 3 else "3"
    sets = json.loads((data / "panda.json").read_text())["sets"]
    with tempfile.NamedTemporaryFile("w", suffix=".txt") as file:
        file.write("\n".join(problem(name, posed) for name, all in sets.items() for posed in all) + "\n")
        file.flush()
        for skipped in STRETCHES:
            answer = subprocess.run([program, file.name, runs, str(skipped)], capture_output=True, text=True, check=True)
            rows = [line.split() for line in answer.stdout.splitlines()]
            solved = [r for r in rows if float(r[4]) > 0 and tuple(r[:2]) != LEFT_OUT]
            print(f"numbers from {skipped}: solved {len(solved)}   whole/ms, 95 %; search/ms, 95 %; length/rad")
            for name in sets:
                print(row(name, [r for r in solved if r[0] == name]))
            print(row("all", solved))


if __name__ == "__main__":
    main()
