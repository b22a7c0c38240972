#!/usr/bin/env python3
"""Another reality for trueup: PyBullet behind protocol 1 (docs/bridge.md), with its contacts, its servos and its pictures.

    pip install pybullet numpy pillow
    python examples/bridge/pybullet_server.py --seed 1                    # listens on 127.0.0.1:5555
    trueup -c 'pick(jar) then place(jar)' --robot bridge://127.0.0.1:5555

The same kitchen as `mujoco_server.py` has, by an engine that does nearly all of it otherwise: servos are velocity constraints
of the solver with a largest torque, contacts are a pyramid of friction, the picture is drawn by a rasteriser that knows no
transparency: its jar is opaque. Drawn from the seed: zeros and damping of the joints, noise of what they read, the
camera's place, how the jar grips, how water runs, where things stand. Water has weight here and no inertia.
"""
import math, tempfile
import xml.etree.ElementTree as xml
import numpy as np
import pybullet as bullet
import kitchen
from kitchen import HOME, JAWS, JOINTS, SIZE
from serve import main
from water import G, Water

TICK, WATER_STEP = 1 / 1000, 0.005
MOST = [105., 105, 105, 105, 52, 52, 52]        # torque of each joint, N·m (Gen3 user guide)


def words(values):
    return " ".join(map(str, values))


def solid(link, kind, place, turned, form, **size):
    """A shape of a link in the words of URDF: `kind` is visual or collision; m, rad."""
    made = xml.SubElement(link, kind)
    xml.SubElement(made, "origin", xyz=words(place), rpy=words(turned))
    xml.SubElement(xml.SubElement(made, "geometry"), form, {key: str(value) for key, value in size.items()})
    return made


def paint(visual, colour):
    xml.SubElement(xml.SubElement(visual, "material", name=words(colour)), "color", rgba=words(colour))


def weigh(link, centre, mass, inertia):
    made = xml.SubElement(link, "inertial")
    xml.SubElement(made, "origin", xyz=words(centre))
    xml.SubElement(made, "mass", value=str(mass))
    xml.SubElement(made, "inertia", {key: str(inertia if key[1] == key[2] else 0) for key in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")})


def load(tree, **how):
    with tempfile.NamedTemporaryFile("w", suffix=".urdf") as file:
        file.write(xml.tostring(tree, encoding="unicode"))
        file.flush()
        return bullet.loadURDF(file.name, flags=bullet.URDF_USE_INERTIA_FROM_FILE, **how)


class Reality:
    name, joints, camera = "pybullet", JOINTS, SIZE

    def __init__(self, seed, cell, exact):
        self.chance, self.cell = np.random.default_rng([seed, 1]), np.random.default_rng([cell, 2])
        drawn = (lambda size, n: np.zeros(n)) if exact else (lambda size, n: self.cell.normal(0, size, n))
        self.zeros = drawn(math.radians(0.3), 7)                        # where the encoders read 0
        self.grip = 0.6 if exact else self.cell.uniform(0.45, 0.9)      # coefficient of friction between pad and jar
        self.damping = np.full(7, .5) if exact else self.cell.uniform(.2, 1., 7)     # N·m·s/rad
        self.noise = (0, 0, 0) if exact else (3e-5, 1e-3, .05)          # of a joint's angle, speed and torque; rad, rad/s, N·m
        self.eye, self.at = kitchen.EYE + drawn(0.01, 3), kitchen.LOOKS_AT + drawn(0.01, 3)
        # One world for each connection: the last one is let go.
        if bullet.isConnected():
            bullet.disconnect()
        bullet.connect(bullet.DIRECT)
        bullet.setGravity(0, 0, -G)
        bullet.setPhysicsEngineParameter(fixedTimeStep=TICK, numSolverIterations=100)
        self.arm = self.build_arm()
        self.build_table()
        self.things = [
            self.vessel(kitchen.walls_of_box(), kitchen.JAR_MASS, [*kitchen.JAR_COLOUR[:3], 1]),
            self.vessel(kitchen.walls_of_round(), kitchen.CUP_MASS, kitchen.CUP_COLOUR)]
        for thing, (x, y, yaw) in zip(self.things, kitchen.places(self.chance)):
            bullet.resetBasePositionAndOrientation(thing, self.frame_of(thing, [x, y, .001], yaw), bullet.getQuaternionFromEuler([0, 0, yaw]))
        self.water, self.wet = Water(kitchen.vessels(self.chance), None if exact else self.cell), 0.0
        self.loads = [(0.0, np.zeros(3))] * 2
        self.q, self.dq, self.since, self.now = HOME.copy(), np.zeros(7), 0.0, 0.0
        self.aim, self.finger, self.speed, self.force, self.felt = 0.085, 0.085, 0.1, 20.0, np.zeros(7)
        self.advance(0.5)

    def build_arm(self):
        tree = xml.parse(kitchen.ROBOT).getroot()
        for link in tree.iter("link"):
            hand = "jaw" in link.get("name") or "gripper" in link.get("name")
            for visual in link.iter("visual"):
                paint(visual, kitchen.HAND_COLOUR if hand else kitchen.ARM_COLOUR)
            if link.get("name") == "gripper_base_link":
                (at, radius), (low, high, thin) = kitchen.BALL, kitchen.STALK
                paint(solid(link, "visual", at, [0, 0, 0], "sphere", radius=radius), kitchen.BALL_COLOUR)
                paint(solid(link, "visual", np.add(low, high) / 2, [math.pi / 2, 0, 0], "cylinder", radius=thin, length=math.dist(low, high)), kitchen.STALK_COLOUR)
            if link.find("inertial") is None:   # a frame, which the engine would give a mass of 1 kg
                weigh(link, [0, 0, 0], 0, 0)
        arm = load(tree, useFixedBase=True)
        joints = {bullet.getJointInfo(arm, i)[1].decode(): i for i in range(bullet.getNumJoints(arm))}
        self.at_joints, self.at_jaws = [joints[name] for name in JOINTS], [joints[name] for name in JAWS]
        for index in range(-1, bullet.getNumJoints(arm)):
            bullet.changeDynamics(arm, index, linearDamping=0, angularDamping=0, jointDamping=0, lateralFriction=1, spinningFriction=.02)
        for index, damping, home in zip(self.at_joints, self.damping, HOME):
            bullet.changeDynamics(arm, index, jointDamping=damping)
            bullet.resetJointState(arm, index, home)
        for index in self.at_jaws:
            bullet.resetJointState(arm, index, 0.0425)
        return arm

    @staticmethod
    def build_table():
        for half, at, colour in (([.6, .4, .01], [.5, 0, -.01], kitchen.TABLE_COLOUR), ([5, 5, .01], [0, 0, -.71], kitchen.FLOOR_COLOUR)):
            body = bullet.createMultiBody(0, bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=half),
                                          bullet.createVisualShape(bullet.GEOM_BOX, halfExtents=half, rgbaColor=colour, specularColor=[0, 0, 0]), at)
            bullet.changeDynamics(body, -1, lateralFriction=.8)
        dot = bullet.createVisualShape(bullet.GEOM_CYLINDER, radius=.012, length=.0008, rgbaColor=[.05, .05, .05, 1], specularColor=[0, 0, 0])
        for x, y in kitchen.DOTS:
            bullet.createMultiBody(0, -1, dot, [x, y, .0004])

    def vessel(self, walls, mass, colour):
        tree = xml.Element("robot", name="vessel")
        link = xml.SubElement(tree, "link", name="vessel")
        weigh(link, np.mean([place for place, _, _ in walls], axis=0), mass, mass * .003)
        for place, half, yaw in walls:
            for kind in ("visual", "collision"):
                if yaw is None:
                    made = solid(link, kind, place, [0, 0, 0], "cylinder", radius=half[0], length=2 * half[1])
                else:
                    made = solid(link, kind, place, [0, 0, yaw], "box", size=words(np.multiply(half, 2)))
                if kind == "visual":
                    paint(made, colour)
        body = load(tree)
        bullet.changeDynamics(body, -1, lateralFriction=self.grip, spinningFriction=.01, linearDamping=0, angularDamping=0)
        return body

    def frame_of(self, thing, place, yaw):
        """Where the engine wants a body whose own frame stands at `place`: it counts from the centre of mass."""
        centre = np.array(bullet.getDynamicsInfo(thing, -1)[3])
        c, s = math.cos(yaw), math.sin(yaw)
        return np.add(place, np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ centre)

    def pose(self, thing):
        """Rotation and place of a thing's own frame."""
        at, turned = bullet.getBasePositionAndOrientation(thing)
        turned = np.array(bullet.getMatrixFromQuaternion(turned)).reshape(3, 3)
        return turned, at - turned @ np.array(bullet.getDynamicsInfo(thing, -1)[3])

    def drawn(self):
        return {"zeros_rad": self.zeros.round(4).tolist(), "viscous_nm_s": self.damping.round(4).tolist(), "grip": round(float(self.grip), 2),
                "discharge": round(float(self.water.discharge), 3), "held_back_mm": round(1e3 * float(self.water.held_back), 2)}

    def advance(self, seconds):
        steps, torques = round(seconds / TICK), np.zeros(7)
        for _ in range(steps):
            self.since += TICK
            aim = self.q + self.dq * min(self.since, .004) + self.zeros
            bullet.setJointMotorControlArray(self.arm, self.at_joints, bullet.POSITION_CONTROL, aim, self.dq, MOST, [.05] * 7, [1] * 7)
            opening = self.opening()
            self.finger = np.clip(self.finger + np.clip(self.aim - self.finger, -self.speed * TICK, self.speed * TICK), opening - .01, opening + .01)
            bullet.setJointMotorControlArray(self.arm, self.at_jaws, bullet.POSITION_CONTROL, [self.finger / 2] * 2, forces=[self.force] * 2)
            for thing, (mass, centre) in zip(self.things, self.loads):
                turned, at = self.pose(thing)
                bullet.applyExternalForce(thing, -1, [0, 0, -G * mass], at + turned @ centre, bullet.WORLD_FRAME)
            bullet.stepSimulation()
            self.now, self.wet = self.now + TICK, self.wet + TICK
            torques += self.read()[2]
            if self.wet >= WATER_STEP:
                self.loads, self.wet = self.water.step(self.now, self.wet, [self.pose(thing) for thing in self.things]), 0.0
        if steps:
            self.felt = torques / steps

    def opening(self):
        return sum(state[0] for state in bullet.getJointStates(self.arm, self.at_jaws))

    def read(self):
        """Angles, speeds and torques of the joints."""
        states = bullet.getJointStates(self.arm, self.at_joints)
        return np.array([(angle, speed, torque) for angle, speed, _, torque in states]).T

    def feedback(self):
        angles, speeds, _ = self.read()
        q, dq, tau = ((value + self.chance.normal(0, sigma, 7)).tolist() for value, sigma in
                      zip((angles - self.zeros, speeds, self.felt), self.noise))
        return {"t": self.now, "q": q, "dq": dq, "tau": tau, "opening": self.opening()}

    def step(self, dt, q=None, dq=None, grip=None):
        if q is not None:
            self.q, self.dq, self.since = np.array(q), np.array(dq) if dq is not None else np.zeros(7), 0.0
        if grip is not None:
            self.aim, self.speed, self.force = grip["opening"], grip["speed"], grip["force"]
        self.advance(dt)
        return self.feedback()

    def stop(self):
        self.q, self.dq = self.read()[0] - self.zeros, np.zeros(7)
        return self.feedback()

    def photo(self):
        view = bullet.computeViewMatrix(self.eye, self.at, [0, 0, 1])
        lens = bullet.computeProjectionMatrixFOV(math.degrees(2 * math.atan(SIZE[1] / 2 / kitchen.FOCAL)), SIZE[0] / SIZE[1], .05, 10)
        pixels = bullet.getCameraImage(*SIZE, view, lens, lightDirection=[.2, -.6, 2.2], shadow=1, lightAmbientCoeff=.6, lightDiffuseCoeff=.35,
                                       lightSpecularCoeff=.05, renderer=bullet.ER_TINY_RENDERER)[2]
        return np.reshape(pixels, (SIZE[1], SIZE[0], 4))[..., :3].astype(np.uint8)


if __name__ == "__main__":
    main(Reality, __doc__)
