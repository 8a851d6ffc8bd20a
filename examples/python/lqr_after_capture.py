"""A linear-quadratic regulator stabilizes the stack after a capture, in comparison with the scenario's own controllers.

    lqr_after_capture.py [folder]        # writes results to the folder

`problem.linearize` gives the model of the servicer with the satellite that it holds in scenarios/wheels-keep-attitude.yaml, at
a time at which the stack rests: a model of the instant of the capture contains the joints' motion and efforts of that instant.
The regulator commands six joints and four wheels from the joints' and the base's positions and rates. The scenario's own
controllers are PD control of the joints and of the attitude. Both are sampled with the same period.
"""

import pathlib
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import grapnel
from grapnel import optimal_control as oc

PERIOD = 0.05  # [s]
REST = 200.0  # time after the capture at which the stack rests under the scenario's own controllers [s]
DEGREE = np.pi / 180
source = pathlib.Path(__file__).resolve().parents[2]
scenario = source / "scenarios/wheels-keep-attitude.yaml"


def regulator(model: grapnel.LinearModel) -> tuple[NDArray[Any], oc.Regulator]:
    """The gain of efforts and wheel torques by [joints, rotation of the base, rates of both], and its Riccati solution."""
    groups = ("joints/position", "base/rotation", "joints/velocity", "base/angular_velocity")
    states = [i for group in groups for i, name in enumerate(model.states) if name.startswith(group)]
    inputs = [i for i, name in enumerate(model.inputs) if name.startswith(("joints/effort", "wheels/torque"))]
    # Deviations and inputs that cost the same (Bryson's rule). Nothing depends on the translation and the wheels' angles; the
    # wheels' rates follow from the momentum.
    size = {"joints/position": DEGREE, "base/rotation": DEGREE, "joints/velocity": DEGREE,
            "base/angular_velocity": 0.5 * DEGREE, "joints/effort": 3.0, "wheels/torque": 0.2}
    Q = np.diag([size[model.states[i].rsplit("/", 1)[0]]**-2 for i in states])
    R = np.diag([size[model.inputs[i].rsplit("/", 1)[0]]**-2 for i in inputs])
    sampled = model.sampled
    assert sampled is not None
    result = oc.dlqr(sampled["Ad"][np.ix_(states, states)], sampled["Bd"][np.ix_(states, inputs)], Q, R)
    return result.K, result


class Lqr:
    """u = -K x about the posture at the impact, the attitude of W, and rest."""

    def __init__(self, K: NDArray[Any]) -> None:
        self.K = K

    def update(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess, output: grapnel.ControllerOutput) -> None:
        """Called at every sample."""
        w, *axis = input.base_quaternion_wxyz
        rotation = 2 * np.arctan2(np.linalg.norm(axis), abs(w)) * np.sign(w) * np.array(axis) / max(float(np.linalg.norm(axis)), 1e-12)
        x = np.concatenate([input.position - input.desired_position, rotation, input.rate, input.base_angular_velocity])
        u = -self.K @ x
        output.effort, output.wheel_torque = u[:input.joints], u[input.joints:]


def measures(result: grapnel.Result, begin: float) -> dict[str, float]:
    """Settling time, effort and peaks after the capture."""
    after = result.time > begin
    time = result.time[after]
    quaternion = result["base/quaternion_wxyz"][after]
    attitude = 2 * np.arcsin(np.minimum(1, np.linalg.norm(quaternion[:, 1:], axis=1)))
    rate = np.linalg.norm(result["base/angular_velocity"][after], axis=1)
    joints, effort, wheel = (result[name][after] for name in ("joints/velocity", "joints/effort", "wheels/torque"))
    posture = np.abs(result["joints/position"][after] - result["joints/reference_position"][after]).max(axis=1)
    moving = (attitude > 0.1 * DEGREE) | (posture > 0.1 * DEGREE) | (rate > 0.01 * DEGREE) | (np.abs(joints).max(axis=1) > 0.01 * DEGREE)
    step = float(np.median(np.diff(time)))
    return {"settling time [s]": float(time[moving][-1] - begin), "peak base rate [deg/s]": rate.max() / DEGREE,
            "peak attitude error [deg]": attitude.max() / DEGREE, "peak joint rate [deg/s]": np.abs(joints).max() / DEGREE,
            "peak joint effort [N m]": np.abs(effort).max(), "peak wheel torque [N m]": np.abs(wheel).max(),
            "joint effort^2 [N^2 m^2 s]": float(np.sum(effort**2) * step), "wheel torque^2 [N^2 m^2 s]": float(np.sum(wheel**2) * step)}


own = grapnel.load(scenario, set={"control": {"period": PERIOD}, "output.interval": 0.1})
capture = float(own["approach.duration"])
model = own.linearize(capture + REST, sample_time=PERIOD, delay=0)
K, solution = regulator(model)
print(f"model at {capture + REST:g} s: {len(model.states)} states, of which the regulator uses {K.shape[1]}, {K.shape[0]} inputs")
print(f"Riccati equation satisfied: {solution.residual < 1e-10} (relative residual below 1e-10)")
print(f"slowest decay: {-np.log(np.abs(solution.eigenvalues).max()) / PERIOD:.4f} 1/s")

lqr = grapnel.load(scenario, set={"control": {"period": PERIOD, "external": True, "base_actuators": True},
                                  "post_impact": {"duration": own["post_impact.duration"], "joints": "controller"},
                                  "output.interval": 0.1})
results = {"own": own.simulate(strict=True), "LQR": lqr.simulate(controller=Lqr(K), strict=True)}
table = {name: measures(result, capture) for name, result in results.items()}
print(f"\n{'':28}{'own':>10}{'LQR':>10}  better")
for row in table["own"]:
    a, b = table["own"][row], table["LQR"][row]
    print(f"{row:28}{a:10.4g}{b:10.4g}  {'LQR' if b < 0.99 * a else 'own' if a < 0.99 * b else 'equal'}")
for name, result in results.items():
    print(f"{name}: captured {result.captured}, ledger passed: {result.ledger.passed}")
    if len(sys.argv) > 1:
        result.save(pathlib.Path(sys.argv[1]) / name, report=False)
