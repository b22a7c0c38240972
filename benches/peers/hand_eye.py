"""Finds where a camera sits on a robot's wrist with OpenCV, beside what `align hand-eye` says of the same pictures.

All five methods of `calibrateHandEye` and both of `calibrateRobotWorldHandEye` are tried. Corners are OpenCV's, and so is the camera,
calibrated from the same pictures unless it is given. Every picture tells where the board is in the robot's base; the
spread is how far these places of the board's middle are from their mean (rms). Left out, a picture is predicted by the
others: the median and the largest of these errors are printed.

    pip install "opencv-python-headless<5" numpy     # 5.0.0 has no calibrateHandEye
    python benches/peers/hand_eye.py poses.csv photos/ 9x6:25 [camera.json]
    python benches/peers/hand_eye.py poses.csv photos/ charuco:5x7:34:28:6x6_250 [camera.json]    # opencv-contrib

The table has the columns that `align hand-eye` reads (m or mm; a rotation vector, roll pitch yaw, or a quaternion). The
camera's file is what `camera calibrate --write` makes.
"""

import csv
import json
import sys
from pathlib import Path

import cv2
import numpy as np

UNITS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "rad": 1.0, "deg": np.pi / 180, "1": 1.0, "": 1.0}


def pose(rotation, place):
    whole = np.eye(4)
    whole[:3, :3], whole[:3, 3] = rotation, np.ravel(place)
    return whole


def rows(path):
    """The pictures' names and base_from_flange of each."""
    with open(path, newline="") as file:
        table = list(csv.reader(file))
    names = [cell.split("[")[0].strip() for cell in table[0]]
    factors = [UNITS[cell.split("[")[1].rstrip("] ") if "[" in cell else ""] for cell in table[0]]
    found = []
    for line in table[1:]:
        cell = {n: v if n == "file" else float(v) * f for n, v, f in zip(names, line, factors)}
        if "rx" in cell:
            rotation = cv2.Rodrigues(np.array([cell["rx"], cell["ry"], cell["rz"]]))[0]
        elif "roll" in cell:
            one = lambda axis, angle: cv2.Rodrigues(np.array(axis) * angle)[0]
            rotation = (
                one([0.0, 0, 1], cell["yaw"]) @ one([0, 1.0, 0], cell["pitch"]) @ one([1.0, 0, 0], cell["roll"])
            )
        else:
            w, v = cell["qw"], np.array([cell["qx"], cell["qy"], cell["qz"]])
            length = np.sqrt(w * w + v @ v)
            w, v = w / length, v / length
            cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
            rotation = np.eye(3) + 2 * w * cross + 2 * cross @ cross
        found.append((cell.get("file"), pose(rotation, [cell["x"], cell["y"], cell["z"]])))
    return found


def chessboard(form):
    """Where a chessboard's corners are on it, and what finds them: points and pixels."""
    size, side = form.split(":")
    size, side = tuple(int(n) for n in size.split("x")), float(side) / 1000
    points = np.zeros((size[0] * size[1], 3), np.float32)
    points[:, :2] = side * np.mgrid[: size[0], : size[1]].T.reshape(-1, 2)

    def find(grey):
        ok, found = cv2.findChessboardCorners(grey, size)
        if not ok:
            return None
        stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 60, 1e-4)
        return points, cv2.cornerSubPix(grey, found, (7, 7), (-1, -1), stop)

    return points, find


def charuco(form):
    """The same of a ChArUco board, of which a part will do."""
    size, side, tag, family = form.split(":")
    columns, rows = (int(n) for n in size.split("x"))
    tags = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, "DICT_" + family.upper()))
    board = cv2.aruco.CharucoBoard((columns, rows), float(side) / 1000, float(tag) / 1000, tags)
    detector, points = cv2.aruco.CharucoDetector(board), np.array(board.getChessboardCorners())

    def find(grey):
        found, numbers, _, _ = detector.detectBoard(grey)
        if numbers is None or len(numbers) < 6:
            return None
        return points[numbers.ravel()], found

    return points, find


def solvers():
    for name in ["TSAI", "PARK", "HORAUD", "ANDREFF", "DANIILIDIS"]:
        yield name, getattr(cv2, "CALIB_HAND_EYE_" + name), False
    for name in ["SHAH", "LI"]:
        yield name, getattr(cv2, "CALIB_ROBOT_WORLD_HAND_EYE_" + name), True


def solved(method, both, robot, board):
    """flange_from_camera by one of OpenCV's methods."""
    if both:
        flange = [np.linalg.inv(a) for a in robot]
        r = cv2.calibrateRobotWorldHandEye(
            [b[:3, :3] for b in board], [b[:3, 3] for b in board],
            [f[:3, :3] for f in flange], [f[:3, 3] for f in flange], method=method)
        return np.linalg.inv(pose(r[2], r[3]))
    r = cv2.calibrateHandEye(
        [a[:3, :3] for a in robot], [a[:3, 3] for a in robot],
        [b[:3, :3] for b in board], [b[:3, 3] for b in board], method=method)
    return pose(*r)


def mean(poses):
    u, _, v = np.linalg.svd(sum(p[:3, :3] for p in poses))
    return pose(u @ np.diag([1, 1, np.linalg.det(u @ v)]) @ v, np.mean([p[:3, 3] for p in poses], axis=0))


def angle(a, b):
    return np.degrees(np.linalg.norm(cv2.Rodrigues(a[:3, :3].T @ b[:3, :3])[0]))


def judged(method, both, robot, board, middle):
    """The spread in mm, and the left-out errors in mm and degrees."""
    x = solved(method, both, robot, board)
    places = np.array([(a @ x @ b @ middle)[:3] for a, b in zip(robot, board)])
    spread = np.sqrt(np.mean(np.sum((places - places.mean(axis=0)) ** 2, axis=1)))
    errors = []
    for i in range(len(robot)):
        others = [k for k in range(len(robot)) if k != i]
        x = solved(method, both, [robot[k] for k in others], [board[k] for k in others])
        z = mean([robot[k] @ x @ board[k] for k in others])
        seen = robot[i] @ x @ board[i]
        errors.append((np.linalg.norm(((seen - z) @ middle)[:3]), angle(seen, z)))
    return spread, np.array(errors)


def main():
    table, folder, form = rows(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
    is_charuco = form.startswith("charuco:")
    points, find = charuco(form.removeprefix("charuco:")) if is_charuco else chessboard(form)
    ordered = sorted(p for p in folder.iterdir() if p.suffix in (".png", ".jpg", ".jpeg"))
    robot, seen = [], []
    for k, (name, a) in enumerate(table):
        grey = cv2.cvtColor(cv2.imread(str(folder / name if name else ordered[k])), cv2.COLOR_BGR2GRAY)
        image, found = grey.shape[::-1], find(grey)
        if found is not None:
            robot.append(a)
            seen.append(found)
    print(f"{sum(len(pixels) for _, pixels in seen)} of {len(table) * len(points)} corners")
    if len(sys.argv) > 4:
        k = json.loads(Path(sys.argv[4]).read_text())["camera"]["intrinsics"]
        matrix = np.array([[k["fx"], 0, k["cx"]], [0, k["fy"], k["cy"]], [0, 0, 1]])
        lens = np.array([k["k1"], k["k2"], k.get("p1", 0), k.get("p2", 0), k.get("k3", 0)])
    else:
        rms, matrix, lens, *_ = cv2.calibrateCamera(*zip(*seen), image, None, None)
        print(f"camera from the same pictures: rms {rms:.3f} px, fx {matrix[0, 0]:.1f} px")
    board = []
    for known, pixels in seen:
        _, turn, place = cv2.solvePnP(known, pixels, matrix, lens)
        board.append(pose(cv2.Rodrigues(turn)[0], place))
    middle = np.append(points.mean(axis=0), 1.0)
    print(f"{len(robot)} of {len(table)} pictures, OpenCV {cv2.__version__}")
    print("method      spread mm   left out: median mm  deg  rms mm  largest mm  deg")
    for name, method, both in solvers():
        spread, errors = judged(method, both, robot, board, middle)
        (mm, deg), (most, worst) = np.median(errors, axis=0), errors.max(axis=0)
        rms = 1e3 * np.sqrt(np.mean(errors[:, 0] ** 2))
        print(f"{name:<11} {1e3 * spread:9.2f} {1e3 * mm:20.2f} {deg:5.2f} {rms:7.2f} {1e3 * most:10.2f} {worst:5.2f}")


main()
