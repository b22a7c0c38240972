#!/usr/bin/env python3
"""How many steps a second MuJoCo takes with the arm, the jar and the cup of `examples/bridge/mujoco_server.py`.

    pip install mujoco numpy; python benches/peers/mujoco_steps.py

The scene and its settings are that server's, but for `STEP`, which is the twin's, and for jar and cup, which are one box and one
cylinder: made of walls they have 200 contacts, and MuJoCo takes 1,100 steps a second. The arm is held by springs and dampers in
its joints, so that nothing but `mj_step` is timed; there is no water. The arm stands, then it holds the jar. The least time of
five times 2,000 steps; `cargo bench --bench step` is ours.
"""
import pathlib, sys, time

sys.path.insert(0, str(pathlib.Path(__file__).parents[2] / "examples" / "bridge"))
import mujoco
import numpy as np

mujoco.Renderer = lambda *_: None    # nothing is drawn
import kitchen
import mujoco_server
from kitchen import JOINTS

STEP = 0.002    # s
(WIDE, TALL), (ROUND, LOW) = kitchen.JAR[:2], kitchen.CUP[:2]
kitchen.walls_of_box = lambda: [((0, 0, TALL / 2), (WIDE / 2, WIDE / 2, TALL / 2), 0.0)]
kitchen.walls_of_round = lambda: [((0, 0, LOW / 2), (ROUND, LOW / 2, 0), None)]


def prepared(holding):
    """The scene at rest; with the jar between the jaws or on the table."""
    reality = mujoco_server.Reality(1, 1, True)
    model, data = reality.model, reality.data
    model.opt.timestep = STEP
    # What the server pushes with from outside, as joint springs and dampers: one call steps it all.
    for joint, stiff, damp in zip(JOINTS, mujoco_server.KP, mujoco_server.KD):
        at = model.joint(joint)
        model.jnt_stiffness[at.id], model.dof_damping[at.dofadr[0]] = stiff, damp
        model.qpos_spring[at.qposadr[0]] = data.qpos[at.qposadr[0]]
    data.qfrc_applied[:] = 0.0
    if holding:
        # The jar is put between the jaws, upright, and gripped with 20 N.
        at = model.joint(model.body("jar").jntadr[0]).qposadr[0]
        left, right = (data.body(name).xpos for name in ("left_jaw_link", "right_jaw_link"))
        place = (left + right) / 2 + 0.04 * data.body("gripper_base_link").xmat.reshape(3, 3)[:, 2]
        data.qpos[at:at + 3] = place - np.array([0, 0, 0.07])
        side = (right - left) / np.linalg.norm(right - left)
        yaw = np.arctan2(side[1], side[0])
        data.qpos[at + 3:at + 7] = [np.cos(yaw / 2), 0, 0, np.sin(yaw / 2)]
    for q_at, v_at in reality.jaws:
        data.qfrc_applied[v_at] = -20.0 if holding else 0.0
    for _ in range(1000):
        mujoco.mj_step(model, data)
    return model, data


def main():
    for holding in (False, True):
        model, data = prepared(holding)
        jar = data.body("jar").xpos.copy()
        least = 1e9
        for _ in range(5):
            begin = time.perf_counter()
            mujoco.mj_step(model, data, nstep=2000)
            least = min(least, time.perf_counter() - begin)
        moved = 1e3 * np.linalg.norm(data.body("jar").xpos - jar)
        what = "holding the jar" if holding else "the arm alone"
        print(f"{what}: {2000 / least:.0f} steps of {1e3 * STEP:.0f} ms a second; {data.ncon} contacts; jar at z {data.body('jar').xpos[2]:.3f} m, "
              f"moved by {moved:.3f} mm in {5 * 2000 * STEP:.0f} s")


if __name__ == "__main__":
    main()
