"""Hides what has no name in an arm that MuJoCo simulates, and writes recordings for `gap` to find it in.

    pip install mujoco scipy
    python benches/peers/hidden_formulas.py FOLDER [NAME ...]
    trueup gap FOLDER/NAME_a.csv FOLDER/NAME_b.csv --robot-dir tests/discovery/recordings

The motions, the controller, the rotors and the noise are those of `control_a` and `control_b` in
`tests/discovery/recordings`; the arm's tip is not measured. What is hidden is written in `HIDDEN` below.
"""

import csv
import json
import shutil
import sys
from pathlib import Path

import mujoco
import numpy as np
from scipy.interpolate import CubicSpline

JOINTS = 7
STEP = 1e-3
REST = 1.0
HERE = Path(__file__).resolve().parents[2] / "tests/discovery/recordings"


def sign(speed):
    return np.tanh(speed / 0.003)


# Joint, from 1, and the torque at it: of time, angle, speed and the torque that its bodies need.
HIDDEN = {
    "control": (1, lambda t, q, dq, load: 0.0),
    "load_friction": (2, lambda t, q, dq, load: -0.12 * abs(load) * sign(dq)),
    "load_cogging": (2, lambda t, q, dq, load: 0.12 * load * np.sin(11 * q + 0.5)),
    "load_cogging_elbow": (4, lambda t, q, dq, load: 0.3 * load * np.sin(7 * q)),
    "warm_grease": (5, lambda t, q, dq, load: -6.0 * np.exp(-t / 6) * dq),
    "warm_gear": (6, lambda t, q, dq, load: -1.5 * np.exp(-t / 6) * sign(dq)),
}


def recorded(name):
    """Returns the times, s, and the commanded angles, rad, of a recording."""
    with open(HERE / f"{name}.csv", newline="") as file:
        rows = list(csv.reader(file))
    columns = [k for k, head in enumerate(rows[0]) if head.startswith("q_cmd_")]
    data = np.array(rows[1:], float)
    return data[:, 0], data[:, columns]


def arm_of(sidecar):
    model = mujoco.MjModel.from_xml_path(str(HERE / "gen3_bare.urdf"))
    model.opt.timestep = STEP
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.opt.gravity[:] = [0, 0, -sidecar["gravity_m_s2"]]
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT) | int(mujoco.mjtDisableBit.mjDSBL_LIMIT)
    model.dof_armature[:] = sidecar["armature_kg_m2"]
    return model


def simulated(name, hidden, seed):
    """Returns times and, row by row, commanded angles, angles, speeds and torques as sensors would read them."""
    sidecar = json.loads((HERE / f"{name}.json").read_text())
    noise, controller = sidecar["noise"], sidecar["controller"]
    kp, kd, most = (np.array(controller[k]) for k in ("kp_nm_per_rad", "kd_nm_s_per_rad", "torque_limit_nm"))
    times, commands = recorded(name)
    path = CubicSpline(times, commands)
    model = arm_of(sidecar)
    arm, asked = mujoco.MjData(model), mujoco.MjData(model)
    arm.qpos[:] = commands[0]
    chance = np.random.default_rng(seed)
    joint, law = hidden
    rows, row = [], 0
    for k in range(-int(REST / STEP), round(times[-1] / STEP) + 1):
        now = k * STEP
        goal, speed = (path(now), path(now, 1)) if now > 0 else (commands[0], np.zeros(JOINTS))
        asked.qpos[:] = goal
        mujoco.mj_forward(model, asked)
        torque = kp * (goal - arm.qpos) + kd * (speed - arm.qvel) + asked.qfrc_bias
        torque = np.clip(torque, -most, most)
        if row < len(times) and now >= times[row] - 1e-9:
            read = lambda value, level: value + chance.normal(size=JOINTS) * np.array(level)
            rows.append([goal, read(arm.qpos, noise["q_rad"]), read(arm.qvel, noise["dq_rad_s"]), read(torque, noise["tau_nm"])])
            row += 1
        mujoco.mj_forward(model, arm)
        j = joint - 1
        arm.qfrc_applied[:] = torque
        arm.qfrc_applied[j] += law(now, arm.qpos[j], arm.qvel[j], arm.qfrc_bias[j])
        mujoco.mj_step(model, arm)
    return times, rows


def main(folder, names):
    folder.mkdir(parents=True, exist_ok=True)
    units = {"q_cmd": "rad", "q": "rad", "dq": "rad/s", "tau": "N*m"}
    head = ["t[s]"] + [f"{stem}_{j + 1}[{unit}]" for stem, unit in units.items() for j in range(JOINTS)]
    for name in names:
        for seed, motion in enumerate(["a", "b"], 1):
            times, rows = simulated(f"control_{motion}", HIDDEN[name], seed)
            with open(folder / f"{name}_{motion}.csv", "w", newline="") as file:
                out = csv.writer(file, lineterminator="\n")
                out.writerow(head)
                out.writerows([f"{t:.3f}", *(f"{value:.5f}" for value in np.concatenate(row))] for t, row in zip(times, rows))
            shutil.copy(HERE / f"control_{motion}.json", folder / f"{name}_{motion}.json")
        print(name)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]), sys.argv[2:] or list(HIDDEN))
