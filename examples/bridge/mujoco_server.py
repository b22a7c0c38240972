#!/usr/bin/env python3
"""A reality for trueup: MuJoCo behind protocol 1 (docs/bridge.md). Copy it for your own simulator or controller.

    pip install mujoco numpy pillow
    python examples/bridge/mujoco_server.py --seed 1                      # listens on 127.0.0.1:5555
    trueup -c 'pick(jar) then place(jar)' --robot bridge://127.0.0.1:5555

The arm comes from trueup's own URDF, the things from the kitchen scene. What a real cell gets wrong is drawn from the
seed: zeros of the joints, their friction and rotors, noise of what they read, the camera's place, how the jar grips, how
water runs, and where things stand. With `--cell N` the robot stays the same while `--seed` moves the things. `--exact` draws
only where things stand. `--tell` prints what was drawn, for whoever judges.
MuJoCo has no water: `water.py` adds it; `kitchen.py` holds the scene, `serve.py` the protocol. The `Reality` class is all
that another server must replace (`pybullet_server.py` is one that did).
"""
import math, os
os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco
import numpy as np
import kitchen
from kitchen import HOME, JAWS, JOINTS, SIZE
from serve import main
from water import Water

# Servo: stiffness and damping of each joint, N·m/rad and N·m·s/rad, and the largest torque, N·m (Gen3 user guide).
KP, KD = np.array([3000., 3000, 3000, 3000, 800, 800, 800]), np.array([120., 120, 120, 120, 20, 20, 20])
MOST = np.array([105., 105, 105, 105, 52, 52, 52])
WATER_STEP = 0.005


class Reality:
    name, joints, camera = "mujoco", JOINTS, SIZE

    def __init__(self, seed, cell, exact):
        self.chance, self.cell = np.random.default_rng([seed, 1]), np.random.default_rng([cell, 2])
        drawn = (lambda size, n=None: np.zeros(n) if n else 0.0) if exact else (lambda size, n=None: self.cell.normal(0, size, n))
        self.zeros = drawn(math.radians(0.3), 7)          # where the encoders read 0
        self.friction = 0.6 if exact else self.cell.uniform(0.45, 0.9)
        large = np.array([1, 1, 1, 1, .3, .3, .3])
        between = lambda least, most: large * ((least + most) / 2 if exact else self.cell.uniform(least, most, 7))
        self.viscous, self.dry, self.rotor = between(.2, 1.), between(.02, .08), between(.05, .2)    # N·m·s/rad, N·m, kg·m2
        self.noise = (0, 0, 0) if exact else (3e-5, 1e-3, .05)    # of a joint's angle, speed and torque; rad, rad/s, N·m
        eye, at = kitchen.EYE + drawn(0.01, 3), kitchen.LOOKS_AT + drawn(0.01, 3)
        self.model = self.build(eye, at)
        self.data = mujoco.MjData(self.model)
        joint = lambda name: self.model.joint(name)
        self.q_at = np.array([joint(j).qposadr[0] for j in JOINTS])
        self.v_at = np.array([joint(j).dofadr[0] for j in JOINTS])
        self.jaws = [(joint(j).qposadr[0], joint(j).dofadr[0]) for j in JAWS]
        self.data.qpos[self.q_at] = HOME
        for q, _ in self.jaws:
            self.data.qpos[q] = 0.0425
        self.q, self.dq, self.since = HOME.copy(), np.zeros(7), 0.0
        self.aim, self.finger, self.speed, self.force = 0.085, 0.085, 0.1, 20.0
        self.place_things()
        mujoco.mj_forward(self.model, self.data)
        self.water, self.wet = Water(kitchen.vessels(self.chance), None if exact else self.cell), 0.0
        self.renderer = mujoco.Renderer(self.model, SIZE[1], SIZE[0])
        self.advance(0.5)

    def build(self, eye, at):
        spec = mujoco.MjSpec.from_file(kitchen.ROBOT)
        spec.compiler.fusestatic = False
        spec.option.timestep, spec.option.integrator = 0.001, mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 10
        spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE
        spec.visual.headlight.ambient, spec.visual.headlight.diffuse = [.45] * 3, [.25] * 3
        for body in spec.bodies:
            if body.name != "world":
                body.gravcomp = 1
            for geom in body.geoms:
                jaw = "jaw" in body.name
                geom.rgba = kitchen.HAND_COLOUR if jaw or "gripper" in body.name else kitchen.ARM_COLOUR
                geom.contype, geom.conaffinity = (1, 1) if jaw else (2, 1)
                geom.friction = [1.0, .02, .001]
                geom.condim = 4
        for name, viscous, dry, rotor in zip(JOINTS, self.viscous, self.dry, self.rotor):
            spec.joint(name).armature, spec.joint(name).damping, spec.joint(name).frictionloss = rotor, [viscous, 0, 0], dry
        for name in JAWS:
            spec.joint(name).armature, spec.joint(name).damping = 0.3, [5.0, 0, 0]
        spec.add_exclude(bodyname1="left_jaw_link", bodyname2="right_jaw_link")
        hand, (at_ball, radius), (low, high, thin) = spec.body("gripper_base_link"), kitchen.BALL, kitchen.STALK
        hand.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=at_ball, size=[radius, 0, 0], rgba=kitchen.BALL_COLOUR, contype=4, conaffinity=0)
        hand.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=[*low, *high], size=[thin, 0, 0], rgba=kitchen.STALK_COLOUR, contype=4, conaffinity=0)
        world = spec.worldbody
        world.add_light(pos=[.5, -.6, 2.2], dir=[0, .25, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, diffuse=[.5] * 3, castshadow=True)
        world.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[.5, 0, -.01], size=[.6, .4, .01], rgba=kitchen.TABLE_COLOUR, friction=[.5, .01, .001])
        world.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0, 0, -.7], size=[5, 5, .1], rgba=kitchen.FLOOR_COLOUR)
        for x, y in kitchen.DOTS:
            world.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[x, y, .0004], size=[.012, .0004, 0], rgba=[.05, .05, .05, 1], contype=4, conaffinity=0)
        back = (eye - at) / np.linalg.norm(eye - at)
        right = np.cross([0, 0, 1], back); right /= np.linalg.norm(right)
        world.add_camera(name="overhead", pos=eye, xyaxes=[*right, *np.cross(back, right)], fovy=math.degrees(2 * math.atan(SIZE[1] / 2 / kitchen.FOCAL)))
        self.vessel(world, "jar", kitchen.walls_of_box(), kitchen.JAR_MASS, kitchen.JAR_COLOUR, kitchen.JAR[1])
        self.vessel(world, "cup", kitchen.walls_of_round(), kitchen.CUP_MASS, kitchen.CUP_COLOUR, kitchen.CUP[1])
        return spec.compile()

    def vessel(self, world, name, walls, mass, rgba, height):
        body = world.add_body(name=name)
        body.add_freejoint()
        for pos, half, yaw in walls:  # a round floor has no yaw
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER if yaw is None else mujoco.mjtGeom.mjGEOM_BOX, pos=pos, size=half, mass=mass / len(walls),
                          quat=[math.cos((yaw or 0) / 2), 0, 0, math.sin((yaw or 0) / 2)], rgba=rgba, friction=[self.friction, .01, .001], condim=4)
        # The water is a body of its own, welded to the vessel, whose mass and centre change; it touches nothing.
        body.add_body(name=f"{name}_water", explicitinertial=True, mass=1e-6, ipos=[0, 0, height / 2], inertia=[1e-9] * 3)

    def place_things(self):
        for name, (x, y, yaw) in zip(("jar", "cup"), kitchen.places(self.chance)):
            at = self.model.joint(self.model.body(name).jntadr[0]).qposadr[0]
            self.data.qpos[at:at + 7] = [x, y, .001, math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]

    def drawn(self):
        rounded = lambda values: [round(float(value), 4) for value in values]
        return {"zeros_rad": rounded(self.zeros), "viscous_nm_s": rounded(self.viscous), "dry_nm": rounded(self.dry), "rotor_kg_m2": rounded(self.rotor),
                "grip": round(float(self.friction), 2), "discharge": round(float(self.water.discharge), 3), "held_back_mm": round(1e3 * float(self.water.held_back), 2)}

    def advance(self, seconds):
        steps, torques = round(seconds / self.model.opt.timestep), np.zeros(7)
        for _ in range(steps):
            self.since += self.model.opt.timestep
            q, dq = self.data.qpos[self.q_at], self.data.qvel[self.v_at]
            aim = self.q + self.dq * min(self.since, .004) + self.zeros
            tau = np.clip(KP * (aim - q) + KD * (self.dq - dq), -MOST, MOST)
            self.data.qfrc_applied[self.v_at] = tau
            torques += tau + self.data.qfrc_gravcomp[self.v_at]
            way = self.speed * self.model.opt.timestep
            opening = sum(self.data.qpos[at] for at, _ in self.jaws)
            self.finger = np.clip(self.finger + np.clip(self.aim - self.finger, -way, way), opening - .01, opening + .01)
            for q_at, v_at in self.jaws:
                push = 4000 * (self.finger / 2 - self.data.qpos[q_at]) - 60 * self.data.qvel[v_at]
                self.data.qfrc_applied[v_at] = np.clip(push, -self.force, self.force)
            mujoco.mj_step(self.model, self.data)
            self.wet += self.model.opt.timestep
            if self.wet >= WATER_STEP:
                self.run_water()
        if steps:  # a sensor of torque is slower than the servo: what it reads is the mean since it was asked last
            self.felt = torques / steps

    def run_water(self):
        bodies = [self.data.body(vessel.name) for vessel in self.water.vessels]
        poses = [(body.xmat.reshape(3, 3), body.xpos) for body in bodies]
        for vessel, (mass, centre) in zip(self.water.vessels, self.water.step(self.data.time, self.wet, poses)):
            water = self.model.body(f"{vessel.name}_water")
            water.mass[:], water.ipos[:], water.inertia[:] = mass + 1e-6, centre, [mass * 4e-4 + 1e-9] * 3
        self.wet = 0.0

    def feedback(self):
        opening = sum(self.data.qpos[q] for q, _ in self.jaws)
        q, dq, tau = (list(value + self.chance.normal(0, sigma, 7)) for value, sigma in
                      zip((self.data.qpos[self.q_at] - self.zeros, self.data.qvel[self.v_at], self.felt), self.noise))
        return {"t": self.data.time, "q": q, "dq": dq, "tau": tau, "opening": opening}

    def step(self, dt, q=None, dq=None, grip=None):
        if q is not None:
            self.q, self.since = np.array(q), 0.0
            self.dq = np.array(dq) if dq is not None else np.zeros(7)
        if grip is not None:
            self.aim, self.speed, self.force = grip["opening"], grip["speed"], grip["force"]
        self.advance(dt)
        return self.feedback()

    def stop(self):
        self.q, self.dq = self.data.qpos[self.q_at] - self.zeros, np.zeros(7)
        return self.feedback()

    def photo(self):
        self.renderer.update_scene(self.data, camera="overhead")
        return self.renderer.render()


if __name__ == "__main__":
    main(Reality, __doc__)
