"""The kitchen scene for a reality behind the bridge: the arm's description, the table's marks, the two vessels, the camera.

m, rad, m3. What it is not: a simulator; every server builds its own bodies from these numbers.
"""
import math, os
import numpy as np
from water import Vessel

ROBOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../stdlib/robots/gen3_2f85/gen3_2f85.urdf")
JOINTS, JAWS = [f"joint_{i}" for i in range(1, 8)], ["left_jaw_joint", "right_jaw_joint"]
HOME = np.radians([0, 15, 180, -130, 0, 55, 90])
SIZE, FOCAL = (1280, 720), 900.0                        # of the picture, px
EYE, LOOKS_AT = np.array([1.25, 0, 0.85]), np.array([0.60, 0, 0.05])
DOTS = [(.25, -.36), (.25, -.18), (.25, .18), (.25, .36), (.5, -.36), (.5, .36), (.8, -.36), (.8, -.12), (.8, .12),
        (.8, .36), (.92, -.25), (.92, 0), (.92, .25)]
JAR, CUP = (.065, .14, .003), (.08, .095, .003)         # side, height, wall; radius, height, wall
JAR_MASS, CUP_MASS, FILLED = .160, .180, 150e-6         # kg, kg, m3
JAR_COLOUR, CUP_COLOUR = [.75, .85, .9, .35], [.125, .314, .753, 1]
TABLE_COLOUR, FLOOR_COLOUR, ARM_COLOUR, HAND_COLOUR = [.784, .690, .565, 1], [.45, .46, .48, 1], [.75, .76, .78, 1], [.25, .25, .27, 1]
BALL, BALL_COLOUR = ([0, .06, .062], .014), [.816, .125, .561, 1]   # by which the camera sees where the hand is: place on the hand, radius
STALK, STALK_COLOUR = ([0, .035, .062], [0, .05, .062], .004), [.2, .2, .2, 1]


def walls_of_box():
    """The jar as boxes: centre, half sizes, yaw."""
    side, height, wall = JAR
    h, s = height / 2, side / 2
    sides = [([dx * (s - wall / 2), dy * (s - wall / 2), h], [wall / 2 if dx else s, wall / 2 if dy else s, h], 0) for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))]
    return [([0, 0, wall / 2], [s, s, wall / 2], 0)] + sides


def walls_of_round(n=48):
    """The cup as a round floor (without a yaw: radius, half height) and `n` boxes around it."""
    radius, height, wall = CUP
    half, mid, turns = radius * math.tan(math.pi / n), radius - wall / 2, [2 * math.pi * k / n for k in range(n)]
    return [([0, 0, wall / 2], [mid, wall / 2, 0], None)] + [
        ([mid * math.cos(t), mid * math.sin(t), height / 2], [wall / 2, half, height / 2], t) for t in turns]


def places(chance):
    """Where the jar and the cup stand: x, y, yaw of each."""
    found = []
    for _ in ("jar", "cup"):
        while True:
            x, y = chance.uniform(.45, .68), chance.uniform(-.27, .27)
            if all(math.hypot(x - a, y - b) > .24 for a, b, _ in found):
                break
        found.append((x, y, chance.uniform(-.6, .6)))
    return found


def vessels(chance):
    return [Vessel.box("jar", *JAR, FILLED, chance), Vessel.round("cup", *CUP, 0.0, chance)]
