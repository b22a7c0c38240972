#!/usr/bin/env python3
"""Whether two folders hold the same trials, line by line: all but wall times and the names of run folders.

    python same_trials.py trials/in-parts trials/in-one
"""

import json
import pathlib
import sys

# What depends on the machine and the moment.
OF_THE_DAY = ("total_s", "run_dir")


def trials(folder):
    lines = [line for file in sorted(pathlib.Path(folder).glob("trials*.jsonl")) for line in file.open()]
    read = [json.loads(line) for line in lines]
    kept = [{key: value for key, value in trial.items() if key not in OF_THE_DAY} for trial in read]
    return sorted(kept, key=lambda trial: (trial["without"], trial["seed"]))


a, b = map(trials, sys.argv[1:3])
differ = [(x, y) for x, y in zip(a, b) if x != y]
for x, y in differ:
    print(f"seed {x['seed']}:\n  {json.dumps(x)}\n  {json.dumps(y)}")
print(f"{len(a)} and {len(b)} trials, {len(differ)} differ")
sys.exit(len(a) != len(b) or bool(differ))
