#!/usr/bin/env python3
"""Tasks on other tables than the kitchen: how often each ends as it should, and whether any run says so falsely.

    cargo build --release
    python scripts/tables.py --seeds 1-5 --out tables

Every row of `tests/tables/tasks.json` is run on the scene of its name with hidden places, camera, joints, friction and
light. A run of the task is followed by a run that clears the view, takes a photograph and asks the conditions again: what
is counted is what that photograph says, not what the first run believed. The last picture of each is kept for people.
"""
import argparse, concurrent.futures, json, pathlib, shutil, subprocess, sys

ROOT = pathlib.Path(__file__).resolve().parent.parent


def one(trueup, task, seed, out):
    """One task with one seed: (what the task's run said, what the photograph says, a line about it)."""
    name = f"{task['scene']}-{sum(map(ord, task['line'])):05d}-{seed}"
    scene = (ROOT / "tests/tables" / f"{task['scene']}.task").read_text()
    checks = " ".join(f"check {condition}" for condition in task["then"])
    script = out / f"{name}.task"
    script.write_text(f"{scene}\ntask the_task() {{ {task['line'].replace(' then ', '  ')} }}\n"
                      f"task afterwards() {{ home() look() {checks} }}\nthe_task()\nafterwards()\n")
    runs = out / name
    done = subprocess.run([trueup, "run", script, "--seed", str(seed), "--record", runs, "--quiet"], capture_output=True, text=True)
    records = [json.loads((folder / "run.json").read_text()) for folder in sorted(runs.iterdir())] if runs.exists() else []
    said = records[0]["outcome"] if records else "nothing"
    seen = records[1]["outcome"] if len(records) > 1 else "not run"
    why = "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["?"])[0]
    return said, seen, why


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("--trueup", default=str(ROOT / "target/release/trueup"))
    args.add_argument("--seeds", default="1-5")
    args.add_argument("--tasks", default="", help="only tasks whose scene or line has this in it")
    args.add_argument("--jobs", type=int, default=2)
    args.add_argument("--out", type=pathlib.Path, default=pathlib.Path("tables"))
    args = args.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    # A scene's meshes lie beside the file that names them.
    for mesh in [*(ROOT / "tests/tables").glob("*.stl"), *(ROOT / "tests/tables").glob("*.obj")]:
        shutil.copy(mesh, args.out)
    first, _, last = args.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    tasks = json.loads((ROOT / "tests/tables/tasks.json").read_text())
    tasks = [task for task in tasks if args.tasks in task["scene"] + " " + task["line"]]
    good = false_success = total = 0
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        rows = [(task, [pool.submit(one, args.trueup, task, seed, args.out) for seed in seeds]) for task in tasks]
        for task, cells in rows:
            results = [cell.result() for cell in cells]
            fine = [said == "success" and seen == "success" for said, seen, _ in results]
            false = [said == "success" and seen not in ("success", "not run") for said, seen, _ in results]
            good, total, false_success = good + sum(fine), total + len(fine), false_success + sum(false)
            print(f"{sum(fine)}/{len(fine)}  {task['scene']:12} {task['line']}", flush=True)
            for seed, (said, seen, why), is_fine in zip(seeds, results, fine):
                if not is_fine:
                    print(f"       seed {seed}: said {said}, the photograph {seen}: {why}", flush=True)
    print(f"{good} of {total}; said success and was not: {false_success}")
    return 0 if good == total else 1


if __name__ == "__main__":
    sys.exit(main())
