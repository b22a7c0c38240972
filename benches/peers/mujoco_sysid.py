"""Times MuJoCo's system identification on the recordings that `gap` is scored on.

It is told which fifteen parameters may be off (dry and fluid friction of seven joints, a payload) and fits them;
it names nothing. `gap` is told nothing and searches some three hundred effects.

    pip install "mujoco[sysid]" scipy
    python benches/peers/mujoco_sysid.py URDF RECORDING.csv [RECORDING.csv ...]

The sidecar beside a recording (`RECORDING.json`) says what the controller and the rotors are. Same model, same
channels (positions and motor torques), one recording fitted.
"""

import csv
import json
import sys
import time

import mujoco
import numpy as np
from mujoco import sysid
from scipy.interpolate import CubicSpline

JOINTS = 7
STEP = 1e-3


def recorded(path):
    """Returns time, s, and the columns of a stem, rows by joints."""
    with open(path, newline="") as file:
        rows = list(csv.reader(file))
    head, data = rows[0], np.array(rows[1:], float)
    group = lambda stem: data[:, [k for k, name in enumerate(head) if name.split("[")[0].rsplit("_", 1)[0] == stem]]
    return data[:, 0], {stem: group(stem) for stem in ("q_cmd", "q", "tau")}


def spec_of(urdf, sidecar):
    """Returns the arm with its rotors and position controller; feed-forward comes with the control."""
    spec = mujoco.MjSpec.from_file(urdf)
    spec.option.timestep = STEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.gravity = [0, 0, -sidecar["gravity_m_s2"]]
    control = sidecar["controller"]
    for geom in list(spec.geoms):
        geom.contype = geom.conaffinity = 0
    joints = [joint for joint in spec.joints]
    for j, joint in enumerate(joints):
        joint.armature = sidecar["armature_kg_m2"][j]
        joint.frictionloss = 0
        joint.damping = np.zeros_like(joint.damping)
        kp, kd = control["kp_nm_per_rad"][j], control["kd_nm_s_per_rad"][j]
        most = control["torque_limit_nm"][j]
        actuator = spec.add_actuator(name=f"a{j}", target=joint.name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        actuator.gaintype, actuator.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        actuator.gainprm[0] = kp
        actuator.biasprm[1], actuator.biasprm[2] = -kp, -kd
        actuator.forcelimited, actuator.forcerange = True, [-most, most]
        spec.add_sensor(name=f"q{j}", type=mujoco.mjtSensor.mjSENS_JOINTPOS, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=joint.name)
    for j in range(JOINTS):
        spec.add_sensor(name=f"tau{j}", type=mujoco.mjtSensor.mjSENS_ACTUATORFRC, objtype=mujoco.mjtObj.mjOBJ_ACTUATOR, objname=f"a{j}")
    return spec, [joint.name for joint in joints]


def controls(model, sidecar, t, q_cmd):
    """Returns 1 kHz times and what makes the affine actuator the recorded controller."""
    times = np.arange(t[0], t[-1], STEP)
    spline = CubicSpline(t, q_cmd)
    q, dq = spline(times), spline(times, 1)
    kp = np.array(sidecar["controller"]["kp_nm_per_rad"])
    kd = np.array(sidecar["controller"]["kd_nm_s_per_rad"])
    data = mujoco.MjData(model)
    gravity = np.empty_like(q)
    for row, here in enumerate(q):
        data.qpos[:] = here
        data.qvel[:] = 0
        mujoco.mj_forward(model, data)
        gravity[row] = data.qfrc_bias
    return times, q + (gravity + kd * dq) / kp


def parameters(spec, names):
    """Returns the fifteen numbers that may be off."""
    wanted = sysid.ParameterDict()
    def friction(name):
        def put(spec, parameter):
            spec.joint(name).frictionloss = float(parameter.value[0])
        return put
    def damping(name):
        def put(spec, parameter):
            joint = spec.joint(name)
            joint.damping = np.full_like(np.atleast_1d(joint.damping), float(parameter.value[0]))
        return put
    for j, name in enumerate(names):
        wanted.add(sysid.Parameter(f"friction_{j + 1}", 0.1, 0.0, 10.0, modifier=friction(name)))
        wanted.add(sysid.Parameter(f"damping_{j + 1}", 0.1, 0.0, 20.0, modifier=damping(name)))
    last = spec.joint(names[-1]).parent.name
    own = float(spec.body(last).mass)
    def payload(spec, parameter):
        spec.body(last).mass = own + float(parameter.value[0])
    wanted.add(sysid.Parameter("payload", 0.0, 0.0, 3.0, modifier=payload))
    return wanted


def main():
    urdf, paths = sys.argv[1], sys.argv[2:]
    spent = []
    for path in paths:
        with open(path.removesuffix(".csv") + ".json") as file:
            sidecar = json.load(file)
        t, data = recorded(path)
        spec, names = spec_of(urdf, sidecar)
        model = spec.compile()
        times, control = controls(model, sidecar, t, data["q_cmd"])
        measured = np.hstack([data["q"], data["tau"]])
        sequence = sysid.ModelSequences(
            "arm", spec, "recording",
            sysid.create_initial_state(model, CubicSpline(t, data["q_cmd"])(t[0])),
            sysid.TimeSeries(times, control, sysid.TimeSeries.compute_all_control_mapping(model)),
            sysid.TimeSeries(t, measured, sysid.TimeSeries.compute_all_sensor_mapping(model)),
        )
        wanted = parameters(spec, names)
        begin = time.perf_counter()
        residual = sysid.build_residual_fn(models_sequences=[sequence])
        found, _ = sysid.optimize(wanted, residual, verbose=False)
        seconds = time.perf_counter() - begin
        spent.append(seconds)
        large = [f"{name} {float(p.value[0]):.3g}" for name, p in found.items() if abs(float(p.value[0])) > 0.05]
        print(f"{path.rsplit('/', 1)[-1]}  {seconds:.1f} s  {', '.join(large)}", flush=True)
    print(f"mean {np.mean(spent):.1f} s, least {min(spent):.1f} s, most {max(spent):.1f} s of {len(spent)}")


if __name__ == "__main__":
    main()
