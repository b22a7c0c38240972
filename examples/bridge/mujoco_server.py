#!/usr/bin/env python3
"""A reality for trueup: MuJoCo behind protocol 1 (docs/bridge.md). Copy it for your own simulator or controller.

    pip install mujoco numpy pillow
    python examples/bridge/mujoco_server.py --seed 1                      # listens on 127.0.0.1:5555
    trueup -c 'pick(jar) then place(jar)' --robot bridge://127.0.0.1:5555

The arm comes from trueup's own URDF, the things from the kitchen scene. What a real cell gets wrong is drawn from the
seed: zeros of the joints, their friction and rotors, noise of what they read, the camera's place, how the jar grips, how
water runs, and where things stand. With `--cell N` the robot stays the same while `--seed` moves the things. `--exact` draws
only where things stand. `--tell` prints what was drawn, for whoever judges.
MuJoCo has no water: `water.py` beside this file adds it. The `Reality` class is all that another server must replace.
"""
import argparse, base64, io, json, math, os, socket
os.environ.setdefault("MUJOCO_GL", "egl")
import mujoco
import numpy as np
from PIL import Image
from water import Vessel, Water

ROBOT = os.path.join(os.path.dirname(__file__), "../../stdlib/robots/gen3_2f85/gen3_2f85.urdf")
JOINTS = [f"joint_{i}" for i in range(1, 8)]
HOME = np.radians([0, 15, 180, -130, 0, 55, 90])
SIZE, FOCAL = (1280, 720), 900.0
DOTS = [(.25, -.36), (.25, -.18), (.25, .18), (.25, .36), (.5, -.36), (.5, .36), (.8, -.36), (.8, -.12), (.8, .12),
        (.8, .36), (.92, -.25), (.92, 0), (.92, .25)]
# Servo: stiffness and damping of each joint, N·m/rad and N·m·s/rad, and the largest torque, N·m (Gen3 user guide).
KP, KD = np.array([3000., 3000, 3000, 3000, 800, 800, 800]), np.array([120., 120, 120, 120, 20, 20, 20])
MOST = np.array([105., 105, 105, 105, 52, 52, 52])
JAR, CUP = (.065, .14, .003), (.08, .095, .003)    # side, height, wall; radius, height, wall
FILLED, WATER_STEP = 150e-6, 0.005


class Reality:
    def __init__(self, seed, cell, exact):
        self.chance, self.cell = np.random.default_rng([seed, 1]), np.random.default_rng([cell, 2])
        drawn = (lambda size, n=None: np.zeros(n) if n else 0.0) if exact else (lambda size, n=None: self.cell.normal(0, size, n))
        self.zeros = drawn(math.radians(0.3), 7)          # where the encoders read 0
        self.friction = 0.6 if exact else self.cell.uniform(0.45, 0.9)
        large = np.array([1, 1, 1, 1, .3, .3, .3])
        between = lambda least, most: large * ((least + most) / 2 if exact else self.cell.uniform(least, most, 7))
        self.viscous, self.dry, self.rotor = between(.2, 1.), between(.02, .08), between(.05, .2)    # N·m·s/rad, N·m, kg·m2
        self.noise = (0, 0, 0) if exact else (3e-5, 1e-3, .05)    # of a joint's angle, speed and torque; rad, rad/s, N·m
        eye = np.array([1.25, 0, 0.85]) + drawn(0.01, 3)
        at = np.array([0.60, 0, 0.05]) + drawn(0.01, 3)
        self.model = self.build(eye, at)
        self.data = mujoco.MjData(self.model)
        joint = lambda name: self.model.joint(name)
        self.q_at = np.array([joint(j).qposadr[0] for j in JOINTS])
        self.v_at = np.array([joint(j).dofadr[0] for j in JOINTS])
        self.jaws = [(joint(j).qposadr[0], joint(j).dofadr[0]) for j in ("left_jaw_joint", "right_jaw_joint")]
        self.data.qpos[self.q_at] = HOME
        for q, _ in self.jaws:
            self.data.qpos[q] = 0.0425
        self.q, self.dq, self.since = HOME.copy(), np.zeros(7), 0.0
        self.aim, self.finger, self.speed, self.force = 0.085, 0.085, 0.1, 20.0
        self.place_things()
        mujoco.mj_forward(self.model, self.data)
        vessels = [Vessel.box("jar", *JAR, FILLED, self.chance), Vessel.round("cup", *CUP, 0.0, self.chance)]
        self.water, self.wet = Water(vessels, None if exact else self.cell), 0.0
        self.renderer = mujoco.Renderer(self.model, SIZE[1], SIZE[0])
        self.advance(0.5)

    def build(self, eye, at):
        spec = mujoco.MjSpec.from_file(ROBOT)
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
                geom.rgba = [.25, .25, .27, 1] if jaw or "gripper" in body.name else [.75, .76, .78, 1]
                geom.contype, geom.conaffinity = (1, 1) if jaw else (2, 1)
                geom.friction = [1.0, .02, .001]
                geom.condim = 4
        for name, viscous, dry, rotor in zip(JOINTS, self.viscous, self.dry, self.rotor):
            spec.joint(name).armature, spec.joint(name).damping, spec.joint(name).frictionloss = rotor, [viscous, 0, 0], dry
        for name in ("left_jaw_joint", "right_jaw_joint"):
            spec.joint(name).armature, spec.joint(name).damping = 0.3, [5.0, 0, 0]
        spec.add_exclude(bodyname1="left_jaw_link", bodyname2="right_jaw_link")
        # The ball on its stalk by which the camera sees where the hand is.
        hand = spec.body("gripper_base_link")
        hand.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, pos=[0, .06, .062], size=[.014, 0, 0], rgba=[.816, .125, .561, 1], contype=4, conaffinity=0)
        hand.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, fromto=[0, .035, .062, 0, .05, .062], size=[.004, 0, 0], rgba=[.2, .2, .2, 1], contype=4, conaffinity=0)
        world = spec.worldbody
        world.add_light(pos=[.5, -.6, 2.2], dir=[0, .25, -1], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL, diffuse=[.5] * 3, castshadow=True)
        world.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, pos=[.5, 0, -.01], size=[.6, .4, .01], rgba=[.784, .690, .565, 1], friction=[.5, .01, .001])
        world.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, pos=[0, 0, -.7], size=[5, 5, .1], rgba=[.45, .46, .48, 1])
        for x, y in DOTS:
            world.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER, pos=[x, y, .0004], size=[.012, .0004, 0], rgba=[.05, .05, .05, 1], contype=4, conaffinity=0)
        back = (eye - at) / np.linalg.norm(eye - at)
        right = np.cross([0, 0, 1], back); right /= np.linalg.norm(right)
        world.add_camera(name="overhead", pos=eye, xyaxes=[*right, *np.cross(back, right)], fovy=math.degrees(2 * math.atan(SIZE[1] / 2 / FOCAL)))
        self.vessel(world, "jar", self.walls_of_box(*JAR), .160, [.75, .85, .9, .35], JAR[1])
        self.vessel(world, "cup", self.walls_of_round(*CUP), .180, [.125, .314, .753, 1], CUP[1])
        return spec.compile()

    def vessel(self, world, name, walls, mass, rgba, height):
        body = world.add_body(name=name)
        body.add_freejoint()
        for pos, half, yaw in walls:  # a round floor has no yaw
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_CYLINDER if yaw is None else mujoco.mjtGeom.mjGEOM_BOX, pos=pos, size=half, mass=mass / len(walls),
                          quat=[math.cos((yaw or 0) / 2), 0, 0, math.sin((yaw or 0) / 2)], rgba=rgba, friction=[self.friction, .01, .001], condim=4)
        # The water is a body of its own, welded to the vessel, whose mass and centre change; it touches nothing.
        body.add_body(name=f"{name}_water", explicitinertial=True, mass=1e-6, ipos=[0, 0, height / 2], inertia=[1e-9] * 3)

    @staticmethod
    def walls_of_box(side, height, wall):
        h, s = height / 2, side / 2
        sides = [([dx * (s - wall / 2), dy * (s - wall / 2), h], [wall / 2 if dx else s, wall / 2 if dy else s, h], 0) for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))]
        return [([0, 0, wall / 2], [s, s, wall / 2], 0)] + sides

    @staticmethod
    def walls_of_round(radius, height, wall, n=48):
        half, mid, turns = radius * math.tan(math.pi / n), radius - wall / 2, [2 * math.pi * k / n for k in range(n)]
        return [([0, 0, wall / 2], [mid, wall / 2, 0], None)] + [
            ([mid * math.cos(t), mid * math.sin(t), height / 2], [wall / 2, half, height / 2], t) for t in turns]

    def place_things(self):
        spots = []
        for name in ("jar", "cup"):
            while True:
                x, y = self.chance.uniform(.45, .68), self.chance.uniform(-.27, .27)
                if all(math.hypot(x - a, y - b) > .24 for a, b in spots):
                    break
            spots.append((x, y))
            yaw, at = self.chance.uniform(-.6, .6), self.model.joint(self.model.body(name).jntadr[0]).qposadr[0]
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
        png = io.BytesIO()
        Image.fromarray(self.renderer.render()).save(png, "PNG")
        return {"png": base64.b64encode(png.getvalue()).decode()}

    def answer(self, request):
        (word, asked), = request.items()
        if word == "hello":
            if asked["version"] != 1:
                return {"error": f"version {asked['version']} is not spoken here", "help": "this is version 1"}
            return {"hello": 1, "name": "mujoco", "joints": JOINTS, "camera": {"width": SIZE[0], "height": SIZE[1]}, "scales": True, "realtime": False}
        if word == "step":
            return self.step(**asked)
        if word == "scales":
            return {"water": [[v.name, v.volume] for v in self.water.vessels], "spilt": self.water.spilt}
        if word in ("feedback", "photo", "stop"):
            return getattr(self, word)()
        return {"error": f"`{word}` is not known", "help": "hello, step, feedback, photo, scales, stop"}


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("--port", type=int, default=5555)
    args.add_argument("--seed", type=int, default=1)
    args.add_argument("--cell", type=int, help="the robot's and the camera's errors; the seed's own unless given")
    args.add_argument("--exact", action="store_true")
    args.add_argument("--tell", action="store_true", help="print what was drawn")
    args.add_argument("--once", action="store_true", help="end with the first connection")
    args = args.parse_args()
    listener = socket.create_server(("127.0.0.1", args.port))
    print(f"bridge://127.0.0.1:{listener.getsockname()[1]}", flush=True)
    while True:
        connection, _ = listener.accept()
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        reality = Reality(args.seed, args.seed if args.cell is None else args.cell, args.exact)  # every connection begins anew
        if args.tell:
            print(json.dumps(reality.drawn()), flush=True)
        with connection, connection.makefile("rwb") as lines:
            for line in lines:
                try:
                    said = reality.answer(json.loads(line))
                except Exception as error:  # a server answers, whatever happens
                    said = {"error": f"{type(error).__name__}: {error}", "help": "see the server's own output"}
                lines.write(json.dumps(said).encode() + b"\n")
                lines.flush()
        if args.once:
            return


if __name__ == "__main__":
    main()
