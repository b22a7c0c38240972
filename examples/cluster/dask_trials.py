#!/usr/bin/env python3
"""`trueup trials` on a Dask cluster: one part a task, merged when all are done.

    pip install 'dask[distributed]'
    python dask_trials.py --task 'pick(jar)' --n 20 --parts 4 --out /shared/trials/pick --scheduler HOST:8786

Without `--scheduler` it uses the machine that it is started on. The program, the task and the folder of `--out` must be at
the same paths on every machine. Started again, each part goes on where it ended.
"""

import argparse
import os
import subprocess

from dask.distributed import Client, LocalCluster, as_completed


def part(i, args):
    """Runs one part; a worker that is lost is replaced, and the part goes on from its last line."""
    command = [args.trueup, "trials", "--task", args.task, "--n", str(args.n), "--shard", f"{i}/{args.parts}",
               "--out", args.out, "--budget", str(args.budget), "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**os.environ, "RAYON_NUM_THREADS": str(args.cpus)})
    return i


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--task", required=True, help="a call or a script")
    parser.add_argument("--n", type=int, default=20, help="how many laboratories")
    parser.add_argument("--parts", type=int, default=4)
    parser.add_argument("--cpus", type=int, default=2, help="processors of a part")
    parser.add_argument("--budget", type=float, default=1800, help="what a trial may take, s of wall time")
    parser.add_argument("--out", required=True, help="a folder that every machine sees")
    parser.add_argument("--trueup", default="trueup", help="the program")
    parser.add_argument("--scheduler", help="HOST:PORT of a cluster; this machine without it")
    parser.add_argument("--workers", type=int, default=2, help="parts at once on this machine")
    args = parser.parse_args()
    cluster = None if args.scheduler else LocalCluster(n_workers=args.workers, threads_per_worker=1)
    with Client(args.scheduler or cluster) as client:
        parts = client.map(part, range(1, args.parts + 1), args=args, pure=False, retries=2)
        for done in as_completed(parts):
            print(f"part {done.result()} is done", flush=True)
    subprocess.run([args.trueup, "trials", "merge", args.out], check=True)


if __name__ == "__main__":
    main()
