"""Impulse of a capture against the target's mass, up to the limit set by the effective mass of arm and floating base.

Simulates many problems on all processors: the scenario at the instant of contact with increasing target mass.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/impulse_against_mass_ratio.py [FOLDER]
"""

import pathlib
import sys

import numpy as np

import grapnel

scenarios = pathlib.Path(__file__).parents[2] / "scenarios"
out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/python/mass-ratio")
out.mkdir(parents=True, exist_ok=True)

base = grapnel.load(scenarios / "thesis" / "open-loop-at-contact.yaml")
servicer = grapnel.Robot(base).mass
ratios = np.geomspace(1e-3, 1e2, 26)  # target mass / servicer mass


def with_target(ratio):
    problem = base.copy()
    scale = ratio * servicer / base.targets[0].mass
    # Set both together, so that mass and inertia are always consistent.
    problem.set({"targets[0].mass": ratio * servicer,
                 "targets[0].inertia": scale * np.array(base["targets[0].inertia"])})
    return problem


results = grapnel.simulate_many([with_target(ratio) for ratio in ratios])
impulse = np.array([result.summary["impact"]["grasps"][0]["impulse_magnitude"] for result in results])

# Effective mass of the servicer at the tip; a property of the configuration.
measure = results[0].summary["impact"]["measures"]["end_effectors"][0]
print(f"servicer {servicer:g} kg, effective mass at the tip {measure['robot_effective_mass']:.3g} kg")
print(f"{'mass ratio':>12}{'impulse [N s]':>16}")
for ratio, P in list(zip(ratios, impulse))[::5]:
    print(f"{ratio:12.3g}{P:16.4f}")
assert np.all(np.diff(impulse) > 0), "the impulse must increase with the target mass"
assert impulse[-1] / impulse[-2] < 1.01, "the impulse must converge for heavy targets"

table = np.column_stack([ratios, impulse])
np.savetxt(out / "impulse.csv", table, delimiter=",", header="mass ratio, impulse [N s]")
try:
    import matplotlib
except ImportError:
    print(f"numbers in {out}/impulse.csv (install matplotlib for a plot)")
else:
    matplotlib.use("agg")
    from matplotlib import pyplot

    pyplot.semilogx(ratios, impulse, ".-")
    pyplot.xlabel("mass of the target over that of the servicer")
    pyplot.ylabel("impulse [N s]")
    pyplot.savefig(out / "impulse.svg")
    print(f"plot in {out}/impulse.svg")
