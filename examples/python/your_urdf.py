"""A robot from URDF, in a scenario that is built in Python.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/your_urdf.py [FOLDER]
"""

import pathlib
import sys

import numpy as np

import grapnel

here = pathlib.Path(__file__).parent
out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/python/your-urdf")

problem = grapnel.Scenario({
    "schema": "grapnel-scenario/1",
    "name": "a robot from URDF",
    "robot": "arm_on_satellite.urdf",
    "import": {"end_effectors": ["gripper"]},
    "initial": {"joints": {"shoulder": 0.9, "elbow": -1.4, "wrist_yaw": 0.3}},
    "targets": [{
        "name": "debris", "mass": 25, "inertia": [1.2, 1.0, 1.4],
        "geometry": {"shape": "box", "size": [0.5, 0.5, 0.5]},
        "state": {"at": "capture", "position": [2.2, 0.6, 0.4], "velocity": [0.0, -0.01, 0.0],
                  "angular_velocity": [0, 0, 0.05]},
        "grasp_points": [{"name": "edge", "position": [-0.25, 0, 0]}],
    }],
    "grasps": [{"end_effector": "gripper", "target": "debris", "point": "edge", "model": "point"}],
    "approach": {"duration": 20, "profile": "quintic", "plan": {}, "final_rates": {"match": "velocity"}},
    "impact": {},
    "post_impact": {"duration": 5, "joints": "free"},
}, folder=here)

for warning in problem.warnings:
    print(warning)

robot = grapnel.Robot(problem)
print(robot, "\njoints:", ", ".join(robot.joints))
q, v = robot.initial_state()
ordinary, floating = robot.jacobian("gripper", q)[:, 6:], robot.generalized_jacobian("gripper", q)
share = 1 - np.linalg.norm(floating[3:]) / np.linalg.norm(ordinary[3:])
print(f"the floating base reduces the gripper speed by {share:.0%}")

result = problem.simulate().raise_if_failed()
print(*result.verdict, sep="\n")
print(f"impulse {result.summary['impact']['grasps'][0]['impulse_magnitude']:.4f} N s")

result.save(out)
print(f"results in {out}")
