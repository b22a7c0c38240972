"""Identifies an arm by the textbook, beside what `gap` says of the same recordings.

It is told that every joint has both frictions, an offset and a rotor, and that every number of every link may be off; it
names nothing. Rows are low-passed without phase, speeds differentiated, rows decimated; torques are linear in all numbers,
which are fitted by weighted least squares with the links' held near the file's. Source: Khalil and Dombre, "Modeling,
Identification and Control of Robots", 2002, chapter 12; Gautier, "Dynamic identification of robots with power model", 1997.

    pip install numpy scipy
    python benches/peers/textbook_identification.py ur10e.urdf u14.csv u15.csv ptp.csv

Columns are `t`, then `q`, `dq` and `tau` of each joint, SI. The last recording is held out.
"""

import sys
import xml.etree.ElementTree as ET

import numpy as np
from scipy.signal import butter, sosfiltfilt

RATE = 100.0  # Hz, of the rows after interpolation
CUT = 6.0  # Hz
EVERY = 10  # rows
CREEP = 0.01  # rad/s, below which dry friction gives way
GRAVITY = 9.81  # m/s^2
# One standard deviation of a file's mass, moment per mass, inertia per mass.
USUAL = np.array([0.3, 0.1, 0.1, 0.1, 0.03, 0.03, 0.03, 0.03, 0.03, 0.03])


def vector(text):
    return np.array([float(number) for number in text.split()])


def cross(v):
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def turn(axis, angle):
    k = cross(axis)
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def rpy(angles):
    x, y, z = np.eye(3)
    return turn(z, angles[2]) @ turn(y, angles[1]) @ turn(x, angles[0])


class Arm:
    """The chain of moving joints of a URDF, and the ten numbers of each link it moves."""

    def __init__(self, path):
        robot = ET.parse(path).getroot()
        links = {link.get("name"): link for link in robot.iter("link")}
        joints = [joint for joint in robot.iter("joint") if joint.find("child") is not None]
        parent = {j.find("child").get("link"): j for j in joints}
        self.places, self.axes, self.file = [], [], []

        def moving(name):
            path = []
            while name in parent:
                path.insert(0, parent[name])
                name = parent[name].find("parent").get("link")
            return path

        chain = max((moving(name) for name in links), key=lambda p: sum(j.get("type") != "fixed" for j in p))
        rotation, place = np.eye(3), np.zeros(3)
        for joint in chain:
            origin = joint.find("origin")
            xyz, angles = (("0 0 0",) * 2 if origin is None else (origin.get(k, "0 0 0") for k in ("xyz", "rpy")))
            place = place + rotation @ vector(xyz)
            rotation = rotation @ rpy(vector(angles))
            if joint.get("type") == "fixed":
                continue
            self.places.append((rotation, place))
            self.axes.append(vector(joint.find("axis").get("xyz")))
            rotation, place = np.eye(3), np.zeros(3)
            self.file.append(self.numbers(links[joint.find("child").get("link")].find("inertial")))
        self.file = np.array(self.file)
        self.n = len(self.axes)

    @staticmethod
    def numbers(inertial):
        mass = float(inertial.find("mass").get("value"))
        origin, inertia = inertial.find("origin"), inertial.find("inertia")
        com, r = vector(origin.get("xyz", "0 0 0")), rpy(vector(origin.get("rpy", "0 0 0")))
        xx, xy, xz, yy, yz, zz = (float(inertia.get(k)) for k in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
        own = r @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ r.T
        own += mass * (com @ com * np.eye(3) - np.outer(com, com))
        return np.concatenate([[mass], mass * com, own[np.triu_indices(3)]])

    def regressor(self, q, dq, ddq):
        """Torques per number of each link, n by 10 n (Atkeson, An and Hollerbach, 1986)."""
        spread = lambda v: np.array(
            [[v[0], v[1], v[2], 0, 0, 0], [0, v[0], 0, v[1], v[2], 0], [0, 0, v[0], 0, v[1], v[2]]]
        )
        speed, turning, moving = np.zeros(3), np.zeros(3), np.array([0, 0, GRAVITY])
        wrenches, turns = [], []
        for (rotation, place), axis, angle, rate, rise in zip(self.places, self.axes, q, dq, ddq):
            r = rotation @ turn(axis, angle)
            moving = r.T @ (moving + np.cross(turning, place) + np.cross(speed, np.cross(speed, place)))
            before = r.T @ speed
            turning = r.T @ turning + np.cross(before, axis * rate) + axis * rise
            speed = before + axis * rate
            wrench = np.zeros((6, 10))
            wrench[:3, 0] = moving
            wrench[:3, 1:4] = cross(turning) + cross(speed) @ cross(speed)
            wrench[3:, 1:4] = -cross(moving)
            wrench[3:, 4:] = spread(turning) + cross(speed) @ spread(speed)
            wrenches.append(wrench)
            turns.append(r)
        torques = np.zeros((self.n, 10 * self.n))
        for link, wrench in enumerate(wrenches):
            for joint in range(link, -1, -1):
                torques[joint, 10 * link : 10 * link + 10] = self.axes[joint] @ wrench[3:]
                force, moment = turns[joint] @ wrench[:3], turns[joint] @ wrench[3:]
                wrench = np.vstack([force, moment + cross(self.places[joint][1]) @ force])
        return torques


def rows(arm, path):
    """The columns of every torque and the torques, rows by joints by numbers and rows by joints."""
    data = np.genfromtxt(path, delimiter=",", skip_header=1)
    time = np.arange(data[0, 0], data[-1, 0], 1 / RATE)
    even = np.array([np.interp(time, data[:, 0], data[:, k]) for k in range(1, 3 * arm.n + 1)]).T
    low = sosfiltfilt(butter(4, CUT / (RATE / 2), output="sos"), even, axis=0)
    q, dq, tau = np.split(low, 3, axis=1)
    ddq = np.gradient(dq, 1 / RATE, axis=0)
    some = slice(int(RATE / 2), -int(RATE / 2), EVERY)
    links = np.array([arm.regressor(*row) for row in zip(q[some], dq[some], ddq[some])])
    own = np.zeros((len(links), arm.n, 4 * arm.n))
    for joint in range(arm.n):
        values = (dq, np.tanh(dq / CREEP), np.ones_like(dq), ddq)
        own[:, joint, joint :: arm.n] = np.stack([v[some, joint] for v in values], axis=1)
    return np.concatenate([links, own], axis=2), tau[some]


def main():
    arm = Arm(sys.argv[1])
    *fitted, (held, held_torque) = [rows(arm, path) for path in sys.argv[2:]]
    columns, torque = (np.concatenate(part) for part in zip(*fitted))
    file = np.concatenate([arm.file.ravel(), np.zeros(4 * arm.n)])
    usual = np.concatenate([(arm.file[:, :1] * USUAL).ravel(), np.full(4 * arm.n, 1e3)])
    weight = np.ones(arm.n)
    for _ in range(5):
        a = (columns / weight[:, None]).reshape(-1, len(file))
        b = ((torque - columns @ file) / weight).ravel()
        change = np.linalg.solve(a.T @ a + np.diag(usual**-2.0), a.T @ b)
        left = torque - columns @ (file + change)
        weight = np.sqrt(np.mean(left**2, axis=0))
    rms = lambda values: np.array2string(np.sqrt(np.mean(values**2, axis=0)), precision=3)
    print("torques held out, rms, N*m ", rms(held_torque))
    print("left of them by the file   ", rms(held_torque - held @ file))
    print("left of them once fitted   ", rms(held_torque - held @ (file + change)))
    names = ["viscous, N*m*s/rad", "dry, N*m", "offset, N*m", "rotor, kg*m^2"]
    for name, numbers in zip(names, change[10 * arm.n :].reshape(4, arm.n)):
        print(f"{name:27}", np.array2string(numbers, precision=2, suppress_small=True))


if __name__ == "__main__":
    main()
