#!/usr/bin/env python3
"""`trueup trials` on a Ray cluster: one part a task, merged when all are done.

    pip install ray
    python ray_trials.py --task 'pick(jar)' --n 20 --parts 4 --out /shared/trials/pick

Started on a machine that is in no cluster, Ray uses that machine. The program, the task and the folder of `--out` must be
at the same paths on every machine. Started again, each part goes on where it ended.
"""

import argparse
import os
import subprocess

import ray

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("--task", required=True, help="a call or a script")
parser.add_argument("--n", type=int, default=20, help="how many laboratories")
parser.add_argument("--parts", type=int, default=4)
parser.add_argument("--cpus", type=int, default=2, help="processors of a part")
parser.add_argument("--budget", type=float, default=1800, help="what a trial may take, s of wall time")
parser.add_argument("--out", required=True, help="a folder that every machine sees")
parser.add_argument("--trueup", default="trueup", help="the program")
args = parser.parse_args()


@ray.remote(num_cpus=args.cpus, max_retries=2)
def part(i):
    """Runs one part; a machine that is lost is replaced, and the part goes on from its last line."""
    command = [args.trueup, "trials", "--task", args.task, "--n", str(args.n), "--shard", f"{i}/{args.parts}",
               "--out", args.out, "--budget", str(args.budget), "--quiet"]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**os.environ, "RAYON_NUM_THREADS": str(args.cpus)})
    return i, ray.get_runtime_context().get_node_id()[:8]


# Ray gives workers way to everything else; here they are the work.
os.environ.setdefault("RAY_worker_niceness", "0")
ray.init(log_to_driver=False)
left = [part.remote(i) for i in range(1, args.parts + 1)]
while left:
    done, left = ray.wait(left)
    print("part %d is done on %s" % ray.get(done[0]), flush=True)
subprocess.run([args.trueup, "trials", "merge", args.out], check=True)
