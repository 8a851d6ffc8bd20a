"""Computes a batch of rollouts: random joint torques from one state, on all processors in SIMD lanes.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/batch_rollout.py
"""

import pathlib
import time

import numpy as np

import grapnel

robots = pathlib.Path(__file__).parents[2] / "robots"
robot = grapnel.Robot(robots / "seven-joint-dual-arm.yaml")

n, steps, step = 1024, 50, 0.02
random = np.random.default_rng(1)
rollout = grapnel.Rollout(robot, step)
start = np.tile(rollout.state(*robot.zero_state()), (n, 1))
torque = random.uniform(-2, 2, (n, steps, robot.nu))  # [N m], each held for one step

begin = time.perf_counter()
states = rollout(start, torque)  # (n, steps, nq + nv)
seconds = time.perf_counter() - begin
print(f"{n} motions of {steps} steps in {1e3 * seconds:.0f} ms: {n * steps / seconds:,.0f} steps per second "
      f"({grapnel.instruction_set()} lanes)")

# Internal torques do not move the centre of mass.
q, v = rollout.split(states[:, -1])
drift = np.linalg.norm(robot.center_of_mass(q) - robot.center_of_mass(start[0, : robot.nq]), axis=1)
turned = 2 * np.arccos(np.clip(np.abs(q[:, 3]), 0, 1))
print(f"the base has rotated by {np.degrees(turned.mean()):.2f} deg on average; the centre of mass has moved by {drift.max():.1g} m "
      "at most")
assert drift.max() < 1e-5

# Spread of the tip positions.
tips = robot.frame_pose(robot.frames[0], q)[:, :3, 3]
print("standard deviation of one tip's position:", np.array2string(tips.std(axis=0), precision=3), "m")
