"""Reads the RRD file of a run with Rerun's own reader and compares it with the run folder.

    trueup export 1 --rrd run.rrd
    python benches/peers/read_rrd.py runs/20260101-100000-pour run.rrd

Needs `rerun-sdk` (seen with 0.41.0) and `numpy`. `rerun rrd verify` must accept the file; then every row of every entity is
counted, and joints, torques, water, poses, fluents and pictures are compared with the folder's own files.
"""

import csv
import json
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
import rerun
from rerun.chunk import RrdReader

folder, file = Path(sys.argv[1]), sys.argv[2]
print("rerun", rerun.__version__)
command = Path(sys.executable).parent / "rerun"
subprocess.run([command, "rrd", "verify", file], check=True)

rows, static = defaultdict(dict), {}
n_chunks = 0
for chunk in RrdReader(file).stream():
    n_chunks += 1
    batch = chunk.to_record_batch()
    columns = {name.split("/")[-1]: batch.column(name) for name in batch.schema.names}
    if chunk.is_static:
        static.setdefault(chunk.entity_path, {}).update(columns)
        continue
    times = batch.column("arm_time").cast("int64").to_numpy()
    for name, column in columns.items():
        if ":" in name:
            rows[chunk.entity_path].setdefault(name, []).extend(zip(times, column))
print(f"{n_chunks} chunks, {len(rows)} entities with times, {len(static)} without")


def numbers(entity, component="Scalars:scalars"):
    """Times in s, and a row of numbers for each."""
    found = rows[entity][component]
    return np.array([time / 1e9 for time, _ in found]), np.array([row.as_py() for _, row in found])


def same(what, found, wanted, tolerance=0.0):
    found, wanted = np.asarray(found, float), np.asarray(wanted, float)
    assert found.shape == wanted.shape, (what, found.shape, wanted.shape)
    known = ~np.isnan(wanted)
    assert (np.isnan(found) == ~known).all(), what
    worst = np.abs(found - wanted)[known].max(initial=0.0)
    assert worst <= tolerance, (what, worst)
    print(f"{what}: {found.shape[0]} rows of {found[0].size if len(found) else 0}, worst difference {worst:.2g}")


run = json.loads((folder / "run.json").read_text())
steps = run["steps"]
arm = list(csv.reader((folder / "arm.csv").read_text().splitlines()))
header, table = arm[0], np.array(arm[1:], float)
for stem, entity in [("q", "position_rad"), ("dq", "velocity_rad_per_s"), ("tau", "torque_Nm"), ("q_cmd", "command_rad")]:
    places = [i for i, name in enumerate(header) if name.split("[")[0].rsplit("_", 1)[0] == stem]
    times, values = numbers(f"/joints/{entity}")
    same(f"{entity}, times", times, table[:, 0], 1e-9)
    same(entity, values, table[:, places])
for column, entity in [("gripper[m]", "/gripper/opening_m"), ("mass[kg]", "/scale/mass_kg")]:
    if column in header:
        same(entity, numbers(entity)[1][:, 0], table[:, header.index(column)])

film = folder / "film" / "film.csv"
if film.exists():
    moments = np.array(list(csv.reader(film.read_text().splitlines()))[1:], float)
    times, values = numbers("/water/twin_mL")
    same("water, times", times, moments[:, 1], 1e-9)
    same("water", values, moments[:, 3:])
    for whose in ["real", "twin"]:
        wanted = sorted(film.parent.glob(f"*-{whose}.jpg"))
        found = [bytes(blob.as_py()[0]) for _, blob in rows[f"/film/{whose}"]["EncodedImage:blob"]]
        assert found == [picture.read_bytes() for picture in wanted], whose
        print(f"/film/{whose}: {len(found)} pictures, the same bytes")

for whose in ["measured", "twin"]:
    states = [step[whose] for step in steps if step.get(whose)]
    if whose == "measured" and run.get("start"):
        states.insert(0, run["start"])
    names = ["tool"] + sorted({o["name"] for s in states for o in s["objects"]})
    for name in names:
        poses = []
        for state in states:
            pose = state["world_from_tool"]
            if name != "tool":
                pose = next((o.get("world_from_object") for o in state["objects"] if o["name"] == name), None)
            if pose:
                poses.append((state["time"], pose["xyz_m"], np.roll(pose["quat_wxyz"], -1)))
        if poses:
            poses.sort(key=lambda pose: pose[0])
            entity = f"/scene/{whose}/{name}"
            at, turned = numbers(entity, "Transform3D:translation")[1], numbers(entity, "Transform3D:quaternion")[1]
            same(entity, at[:, 0], [pose[1] for pose in poses], 1e-6)
            same(f"{entity}, turned", turned[:, 0], [pose[2] for pose in poses], 1e-6)

names = static["/fluents/measured"]["SeriesLines:names"][0].as_py()
for whose in ["expected", "twin", "measured"]:
    wanted = []
    for step in sorted(steps, key=lambda step: step["interval_s"][1]):
        truth = {row["name"]: row[whose] for row in step["fluents"]}
        wanted.append([np.nan if truth.get(name) is None else float(truth[name]) for name in names])
    same(f"/fluents/{whose}", numbers(f"/fluents/{whose}")[1], wanted)

for whose in ["real", "twin"]:
    if f"/camera/{whose}" in rows:
        found = [bytes(blob.as_py()[0]) for _, blob in rows[f"/camera/{whose}"]["EncodedImage:blob"]]
        kept = [path.read_bytes() for path in (folder / "frames").iterdir() if f"-{whose}." in path.name]
        assert all(picture in kept for picture in found), whose
        print(f"/camera/{whose}: {len(found)} pictures, the same bytes")

log = [text.as_py()[0] for _, text in rows["/steps"]["TextLog:text"]]
assert len(log) == 2 * len(steps) and f"step 1: {steps[0]['action']}" in log
print(f"/steps: {len(log)} lines; /events: {len(rows['/events'].get('TextLog:text', []))} lines")
if "/scene/arm" in rows:
    times, _ = numbers("/scene/arm/tool_frame", "Transform3D:translation")
    at = numbers("/scene/arm/tool_frame", "Transform3D:translation")[1][:, 0]
    off = []
    for state in [run["start"], *(step["measured"] for step in steps)]:
        nearest = np.abs(times - state["time"]).argmin()
        off.append(np.linalg.norm(at[nearest] - state["world_from_tool"]["xyz_m"]))
    links = [entity for entity in rows if entity.startswith("/scene/arm/")]
    print(f"{len(links)} links of {len(times)} rows; tool off by {1e3 * np.median(off):.2f} mm (median) at the steps' ends")
print("the same")
