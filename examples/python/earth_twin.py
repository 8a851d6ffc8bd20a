"""An experiment on Earth: the scaled twin of the thesis's dual-arm robot, and the accuracy of a measured impulse.

The twin floats on air bearings. Without gravity in the plane, three ratios can be chosen: of lengths, masses and times.
The script scales the robot, its targets and its motion, simulates both, and checks that impulses scale exactly. It then
simulates sensors, estimates the impulse at each grasp from their readings 400 times, and compares the errors with
their predicted standard deviations. docs/validation/earth-twin.md explains the results.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/earth_twin.py [FOLDER]
"""

import pathlib
import sys

import numpy as np

import grapnel

LENGTH, MASS, TIME = 0.2, 0.04, 0.25  # of the twin relative to the robot in space
CLOSING = 0.05  # relative speed of both grasps, in space [m/s]
RATE = 200  # of the motion capture [Hz]
MARKERS = 1e-4  # standard deviation of a body's position in one reading [m]
FORCE, SAMPLING, CONTACT = 0.05, 2000, 0.01  # force sensor: noise [N], rate [Hz]; duration of the contact [s]
TILT = 1.43e-4  # largest acceleration by the table's tilt, as in scenarios/air-bearing-spot.yaml [m/s^2]
MASS_ERROR = 1e-3  # relative standard deviation of the weighed masses
DRAWS = 400

source = pathlib.Path(__file__).parents[2]
out = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else "out/python/earth-twin")
out.mkdir(parents=True, exist_ok=True)


def twin_of(problem):
    """The scenario in other units of length, mass and time. Angles stay; rates are divided by the ratio of times."""
    changes = {}

    def scale(path, factor):
        changes[path] = (factor * np.array(problem[path])).tolist()

    bodies = ["robot.base", *(f"robot.links[{i}]" for i in range(len(problem.robot.links))),
              *(f"targets[{i}]" for i in range(len(problem.targets)))]
    for body in bodies:
        scale(f"{body}.mass", MASS)
        scale(f"{body}.inertia", MASS * LENGTH**2)
        scale(f"{body}.com", LENGTH)
    for i in range(len(problem.robot.links)):
        scale(f"robot.links[{i}].joint.origin.position", LENGTH)
    for i in range(len(problem.robot.end_effectors)):
        scale(f"robot.end_effectors[{i}].position", LENGTH)
    for i, target in enumerate(problem.targets):
        scale(f"targets[{i}].state.position", LENGTH)
        scale(f"targets[{i}].state.velocity", LENGTH / TIME)
        scale(f"targets[{i}].state.angular_velocity", 1 / TIME)
        for k in range(len(target.grasp_points)):
            scale(f"targets[{i}].grasp_points[{k}].position", LENGTH)
    for i in range(len(problem.grasps)):
        scale(f"grasps[{i}].relative_velocity", LENGTH / TIME)
    for path in ("approach.duration", "impact.duration", "post_impact.duration", "output.interval"):
        scale(path, TIME)
    twin = problem.copy()
    twin.set(changes)
    return twin


def grasps_of(result):
    return result.summary["impact"]["grasps"]


space = grapnel.load(source / "scenarios" / "thesis" / "open-loop-case-1-planned.yaml", set={
    "approach.final_rates": {"match": "twist"},
    "grasps.tip-1.relative_velocity": [0, CLOSING, 0], "grasps.tip-2.relative_velocity": [0, -CLOSING, 0],
    "post_impact.duration": 4, "output": {"interval": 1 / RATE / TIME}})
twin = twin_of(space)
in_space, on_earth = space.simulate(strict=True), twin.simulate(strict=True)

# ---- What has to be built ----

robot = twin.robot
print(f"ratios: length {LENGTH:g}, mass {MASS:g}, time {TIME:g}; impulse {MASS * LENGTH / TIME:g}, "
      f"force {MASS * LENGTH / TIME**2:g}, torque {MASS * LENGTH**2 / TIME**2:g}")
print(f"base {robot.base.mass:g} kg, links {robot.links[0].mass:g} kg and "
      f"{robot.links[1].joint.origin.position[0]:g} m, targets {twin.targets[0].mass:g} kg; approach {twin.approach.duration:g} s, relative speed "
      f"{CLOSING * LENGTH / TIME:g} m/s, spin {twin.targets[0].state.angular_velocity[2]:g} rad/s")
for a, b in zip(grasps_of(in_space), grasps_of(on_earth)):
    ratio = b["impulse_magnitude"] / a["impulse_magnitude"] / (MASS * LENGTH / TIME)
    print(f"{a['end_effector']}: {a['impulse_magnitude']:.6g} N s in space, {b['impulse_magnitude']:.6g} N s on Earth; "
          f"off the ratio by {abs(ratio - 1):.1e}")
    assert abs(ratio - 1) < 1e-9, "the twin's impulse must scale"

# ---- The impulse from motion capture of the target ----

# The experiment: both grasps close 10 % faster than planned. Only the planned motion is known to the estimate.
experiment = twin.copy()
for i in range(2):
    velocity = f"grasps[{i}].relative_velocity"
    experiment[velocity] = (1.1 * np.array(twin[velocity])).tolist()
measured = experiment.simulate(strict=True)
contact = on_earth.summary["approach"]["end"]["time"]
random = np.random.default_rng(1)


def weights_of_change(instants, order):
    """Weights by which positions at these times from the contact give the change of velocity in it.

    The position is continuous; the acceleration by the tilt is the same before and after. The motion afterwards has
    further powers of time up to `order`.
    """
    after = np.where(instants > 0, instants, 0)
    columns = [np.ones_like(instants), instants, instants**2 / 2, after, *(after**k for k in range(2, order + 1))]
    return np.linalg.pinv(np.column_stack(columns))[3]


def estimates(index, before, after, order):
    """Errors of the impulse on a target, their predicted standard deviations, and the impulse's size [N s].

    `order` 1: positions afterwards are relative to the planned motion, which is simulated. Higher: polynomials alone.
    """
    target, grasp = twin.targets[index], grasps_of(measured)[index]
    path = f"targets/{target.name}/position"
    time = measured.time - contact
    phase = np.searchsorted(time, 1e-9)  # the first sample of the motion afterwards, at the contact
    chosen = [k for k in range(len(time)) if -before <= time[k] <= after and k not in (phase - 1, phase)]
    instants, position = time[chosen], measured[path][chosen, :2]
    if order == 1:
        planned = on_earth[path][chosen, :2]
        start = np.array(on_earth[path][phase, :2])
        change = np.array(grasps_of(on_earth)[index]["impulse"][:2]) / -target.mass
        linear = start + np.outer(np.where(instants > 0, instants, 0), change)
        position = position - planned + linear
    weights = weights_of_change(instants, order)
    tilt = TILT * random.uniform(-1, 1, (DRAWS, 1, 2)) * instants[:, None] ** 2 / 2
    readings = position + tilt + MARKERS * random.standard_normal((DRAWS, len(instants), 2))
    mass = target.mass * (1 + MASS_ERROR * random.standard_normal((DRAWS, 1)))
    truth = -np.array(grasp["impulse"][:2])  # on the target
    deviation = np.hypot(target.mass * MARKERS * np.linalg.norm(weights), MASS_ERROR * truth)
    return mass * np.einsum("k,nkc->nc", weights, readings) - truth, deviation, np.hypot(*truth)


rows = []
print(f"\nmotion capture of the targets: {RATE} Hz, {MARKERS * 1e3:g} mm; {DRAWS} draws")
print(f"{'afterwards':>24}{'window':>9}{'grasp':>8}{'impulse':>12}{'rms error':>13}{'relative':>10}{'inside 95 %':>13}")
for order, name in ((3, "polynomial"), (1, "relative to the plan")):
    for window in (0.1, 0.2, 0.4, 0.8):
        for index in range(2):
            error, deviation, size = estimates(index, 1, window, order)
            rms = np.sqrt(np.mean(np.sum(error**2, axis=1)))
            inside = np.mean(np.abs(error) < 1.96 * deviation)
            rows.append((order, window, index + 1, size, rms, rms / size, inside))
            print(f"{name:>24}{window:7g} s{f'tip-{index + 1}':>8}{size:8.4f} N s{rms:9.5f} N s{rms / size:10.2%}"
                  f"{inside:13.1%}")
table = np.array(rows)
best = table[(table[:, 0] == 1) & (table[:, 1] == 0.4)]
assert np.all(best[:, 5] < 0.03), "the impulse must be measurable"
assert np.all(best[:, 6] > 0.9), "the errors must have their predicted size"

# ---- Other sensors ----

size = best[0, 3]
base = robot.base.mass * best[0, 4] / twin.targets[0].mass  # cameras on the base: its mass in place of the target's
samples = SAMPLING * CONTACT
force = FORCE * np.sqrt(samples) / SAMPLING
print("\nother sensors, standard deviation relative to the impulse")
print(f"  the same cameras on the base of {robot.base.mass:g} kg: {base / size:.0%}")
print(f"  force sensor, {FORCE:g} N at {SAMPLING:g} Hz over {CONTACT * 1e3:g} ms: {force / size:.2%}")
slow = 0.5 * TILT * twin.approach.duration**2
print(f"tilt: all bodies move by up to {slow * 1e3:.2g} mm during the approach; their relative motion does not change")
np.savetxt(out / "accuracy.csv", table, delimiter=",",
           header="order, window [s], grasp, impulse [N s], rms error [N s], relative, inside 95 %")
