"""A first capture: load a scenario, change a value, simulate, print results, write the report.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/first_capture.py [FOLDER]
"""

import pathlib
import sys

import numpy as np

import grapnel

scenarios = pathlib.Path(__file__).parents[2] / "scenarios"
out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/python/first-capture")

# Two seven-joint arms capture a tumbling satellite by its handles. Invalid values raise grapnel.InputError on
# assignment, for example problem.targets[0].mass = -130.
problem = grapnel.load(scenarios / "dual-arm-satellite-handles.yaml")
print(f"{problem.name}: {len(problem.targets)} target of {problem.targets[0].mass} kg")
problem.targets[0].mass = 1.2 * problem.targets[0].mass
problem.post_impact.duration = 10

result = problem.simulate()
print(*result.verdict, sep="\n")

print("impulses:")
for grasp in result.summary["impact"]["grasps"]:
    print(f"  {grasp['end_effector']}: {grasp['impulse_magnitude']:.3f} N s")

w = result["base/angular_velocity"]  # (samples, 3), in W
fastest = np.argmax(np.linalg.norm(w, axis=1))
print(f"maximum base rate at t = {result.time[fastest]:.2f} s: {np.linalg.norm(w[fastest]):.5f} "
      f"{result.units['base/angular_velocity']}")

worst = max((check for check in result.ledger.values() if check.kind == "conservation" and check.applies),
            key=lambda check: check.value / check.bound)
print(f"the tightest conservation check: {worst.name} = {worst.value:.2g}, bound {worst.bound:g}")
assert result.ledger.passed

result.save(out)
print(f"results in {out}:", ", ".join(sorted(file.name for file in out.iterdir())))
