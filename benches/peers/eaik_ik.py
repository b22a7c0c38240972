#!/usr/bin/env python3
"""How long EAIK takes for every solution of a UR5e's inverse kinematics.

    pip install eaik; python benches/peers/eaik_ik.py

Poses of 5,000 random joint positions, handed over in one batch to one thread, so that Python costs little. Each time is the least of
five rounds. Ours beside it: `cargo bench --bench plan -- 'all solutions of ur5e'`.
"""
import time

import numpy as np
from eaik.IK_DH import DhRobot

# Universal Robots, "DH parameters for calculations of kinematics and dynamics".
D = np.array([0.1625, 0, 0, 0.1333, 0.0997, 0.0996])
A = np.array([0, -0.425, -0.3922, 0, 0, 0])
ALPHA = np.array([np.pi / 2, 0, 0, np.pi / 2, -np.pi / 2, 0])

arm = DhRobot(ALPHA, A, D)
positions = np.random.default_rng(0).uniform(-3.1, 3.1, (5000, 6))
poses = [arm.fwdKin(q) for q in positions]
times = []
for _ in range(5):
    begin = time.perf_counter()
    found = arm.IK_batched(poses, 1)
    times.append((time.perf_counter() - begin) / len(poses))
turn = 2 * np.pi
own = sum(
    any(np.abs((np.array(s) - q + np.pi) % turn - np.pi).max() < 1e-6 for s in solutions.Q)
    for solutions, q in zip(found, positions)
)
mean = np.mean([len(solutions.Q) for solutions in found])
print(f"{arm.getKinematicFamily()}: {1e6 * min(times):.1f} us a pose, {mean:.1f} solutions, {own} of {len(poses)} with its own")
