"""Measure the things in the photographs of clear things: sizes of each form, and where each piece stands.

    python scripts/sight_forms.py DIR

DIR holds the masks (real_080-mask.png and so on) and reference_from_depth.json, which has the tables' planes. A solid of
each form is drawn into the masks and its sizes and places are moved until it fills them best (intersection over union);
pieces of one kind have one size. The mug is in no mask: it is cut out by OpenCV's GrabCut in a box, without its handle and
what the apple touches. Prints what examples/sight_battery/forms.rs declares. Needs numpy, scipy and opencv-python.
"""

import json
import sys

import cv2
import numpy as np
from scipy.optimize import minimize

FOCAL, CENTRE = 921.0, np.array([642.0, 359.0])
ROUND = np.linspace(0, 2 * np.pi, 40, endpoint=False)


def projection(plane):
    """World on the table: the origin where the axis of view meets it, x to the right, y away; as in photos.rs."""
    normal, eye = np.array(plane[:3]) / np.linalg.norm(plane[:3]), plane[3]
    right = np.array([1.0, 0, 0]) - normal * normal[0]
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(normal, right), normal])
    origin = np.array([0, 0, -eye / normal[2]])

    def pixels(points):
        camera = points @ axes + origin
        return FOCAL * camera[:, :2] / camera[:, 2:] + CENTRE

    return pixels


def square(half, round_, z):
    turns = [np.linspace(k, k + np.pi / 2, 6) for k in np.arange(4) * np.pi / 2]
    corners = [np.array([1, 1]), np.array([-1, 1]), np.array([-1, -1]), np.array([1, -1])]
    flat = [(half - round_) * c + round_ * np.stack([np.cos(t), np.sin(t)], 1) for c, t in zip(corners, turns)]
    flat = np.concatenate(flat)
    return np.column_stack([flat, np.full(len(flat), z)])


def circle(radius, z):
    return np.column_stack([radius * np.cos(ROUND), radius * np.sin(ROUND), np.full(len(ROUND), z)])


def hulls(rings):
    return [np.concatenate(pair) for pair in zip(rings, rings[1:])]


def bottle(half, round_, shoulder, neck_from, neck, height, foot):
    rings = [square(half - foot, max(round_ - foot, 0.002), 0.0), square(half, round_, 1.2 * foot)]
    for turn in np.linspace(0, np.pi / 2, 6):
        wide = neck + (half - neck) * np.cos(turn)
        corner = min(wide - 1e-4, round_ + (neck - round_) * (1 - np.cos(turn)))
        rings.append(square(wide, corner, shoulder + (neck_from - shoulder) * np.sin(turn)))
    return hulls(rings + [circle(neck, neck_from), circle(neck, height)])


def flower(middle, petal, thick):
    axis = middle * np.cos(np.pi / 5) + petal
    discs = [(middle * np.cos(t), axis + middle * np.sin(t), petal) for t in np.pi / 2 + np.arange(5) * 2 * np.pi / 5]
    side = lambda x, z, r, y: np.column_stack([x + r * np.cos(ROUND), np.full(len(ROUND), y), z + r * np.sin(ROUND)])
    return [np.concatenate([side(*d, -thick / 2), side(*d, thick / 2)]) for d in discs + [(0.0, axis, 0.9 * middle)]]


def tumbler(top, top_round, foot, foot_round, height):
    return hulls([square(foot, foot_round, 0.0), square(top, top_round, height)])


def lying(top, top_round, foot, foot_round, height):
    """The tumbler on one of its sides, its foot at the origin and its mouth along x."""
    tilt = np.arctan2(top - foot, height)
    turn = np.array([[np.cos(tilt), 0, -np.sin(tilt)], [0, 1, 0], [np.sin(tilt), 0, np.cos(tilt)]])
    pieces = [p[:, [2, 1, 0]] @ turn.T for p in tumbler(top, top_round, foot, foot_round, height)]
    lowest = min(p[:, 2].min() for p in pieces)
    return [p - [0, 0, lowest] for p in pieces]


def mug(foot, low, high, rim, height):
    return hulls([circle(foot, 0), circle(foot, 0.006), circle(low, 0.025), circle(high, 0.6 * height), circle(rim, height)])


def missed(form, place, pixels, mask, counts=None):
    """One less the overlap of a form at a place with a mask, where it counts."""
    ys, xs = np.where(mask)
    x0, y0 = max(xs.min() - 30, 0), max(ys.min() - 30, 0)
    part = mask[y0 : ys.max() + 31, x0 : xs.max() + 31].astype(float)
    drawn = np.zeros(part.shape, np.uint8)
    c, s = np.cos(place[2]), np.sin(place[2])
    for piece in form:
        at = pixels(piece @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [place[0], place[1], 0])
        hull = cv2.convexHull((at - [x0, y0]).astype(np.float32))[:, 0]
        cv2.fillConvexPoly(drawn, np.round(16 * hull).astype(np.int32), 255, cv2.LINE_AA, 4)
    drawn = drawn / 255.0
    if counts is not None:
        counted = counts[y0 : y0 + part.shape[0], x0 : x0 + part.shape[1]]
        drawn, part = drawn * counted, part * counted
    return 1 - np.minimum(drawn, part).sum() / np.maximum(drawn, part).sum()


def fitted(name, loss, start, steps):
    """Moves the sizes and places until the loss is least: Nelder and Mead, five times from where it came to."""
    at, steps = np.array(start), np.array(steps)
    for _ in range(5):
        simplex = np.concatenate([at[None], at + np.diag(steps)])
        options = dict(initial_simplex=simplex, maxfev=1200, xatol=1e-5, fatol=1e-6)
        at = minimize(loss, at, method="Nelder-Mead", options=options).x
        steps = steps * 0.4
    print(f"{name}: missed {loss(at):.3f}; {np.round(at, 4).tolist()}")


def pieces_of(folder, scene):
    mask = cv2.imread(f"{folder}/real_{scene}-mask.png", 0) > 0
    count, labels = cv2.connectedComponents(mask.astype(np.uint8))
    return [labels == k for k in range(1, count)]


def main():
    folder = sys.argv[1]
    planes = {k: v["table_plane_n_d"] for k, v in json.load(open(f"{folder}/reference_from_depth.json"))["scenes"].items()}

    # Three standing bottles of one size; the fourth lies.
    pixels, masks = projection(planes["080"]), pieces_of(folder, "080")[:3]

    def loss(v):
        half, round_, shoulder, neck_from, _, height, foot = v[:7]
        if not (foot < round_ < half and shoulder < neck_from < height):
            return 10.0
        return sum(missed(bottle(*v[:7]), v[7 + 3 * k : 10 + 3 * k], pixels, masks[k]) for k in range(3))

    start = [0.028, 0.012, 0.115, 0.14, 0.017, 0.163, 0.004, 0.019, -0.034, 0.2, 0.179, -0.072, 0.5, -0.084, -0.095, -0.1]
    fitted("bottles", loss, start, [0.003, 0.003, 0.008, 0.005, 0.002, 0.003, 0.001] + [0.006, 0.006, 0.4] * 3)

    # Three flowers of one size.
    pixels, masks = projection(planes["123"]), pieces_of(folder, "123")
    loss = lambda v: sum(missed(flower(*v[:3]), v[3 + 3 * k : 6 + 3 * k], pixels, masks[k]) for k in range(3))
    start = [0.026, 0.014, 0.03, 0.186, 0.089, 0, 0.332, 0.038, 0, -0.0275, -0.08, 0]
    fitted("flowers", loss, start, [0.003, 0.003, 0.006] + [0.006, 0.006, 0.15] * 3)

    # A lying tumbler by itself, and the standing one as far as the next does not touch it.
    pixels, (touching, alone) = projection(planes["130"]), pieces_of(folder, "130")
    v_, u_ = np.mgrid[: alone.shape[0], : alone.shape[1]]
    standing = touching & (u_ < 850) & (v_ < 205)
    counts = (v_ < 205) & ~((v_ > 183) & (u_ > 760))

    def loss(v):
        if not (v[1] < v[0] and v[3] < v[2]):
            return 10.0
        return missed(lying(*v[:5]), v[5:8], pixels, alone) + missed(tumbler(*v[:5]), v[8:11], pixels, standing, counts)

    start = [0.034, 0.02, 0.024, 0.004, 0.106, 0.34, -0.17, 2.9, 0.119, 0.198, 0.2]
    fitted("tumblers", loss, start, [0.003, 0.006, 0.003, 0.001, 0.004, 0.02, 0.02, 0.2, 0.006, 0.006, 0.3])

    # The mug, cut out.
    image = cv2.imread(f"{folder}/real_130-opaque-rgb-img.jpg")
    mask = np.zeros(image.shape[:2], np.uint8)
    cv2.grabCut(image, mask, (385, 250, 215, 240), np.zeros((1, 65)), np.zeros((1, 65)), 6, cv2.GC_INIT_WITH_RECT)
    mask = cv2.morphologyEx((mask & 1) * 255, cv2.MORPH_CLOSE, np.ones((9, 9)))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask)
    mask = labels == 1 + stats[1:, 4].argmax()
    mask &= ~((u_ > 543) & (v_ > 285) & (v_ < 415))
    counts = ~((u_ > 543) & (v_ > 285) & (v_ < 415)) & ~((u_ < 427) & (v_ > 425))
    loss = lambda v: missed(mug(*v[:5]), [v[5], v[6], 0.0], pixels, mask, counts)
    fitted("mug", loss, [0.042, 0.04, 0.04, 0.044, 0.128, -0.1, -0.08], [0.003] * 4 + [0.01, 0.006, 0.006])


if __name__ == "__main__":
    main()
