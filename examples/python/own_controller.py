"""A user-defined controller in Python: the law of examples/controllers/own_pd.c in the scenario of that example.

    own_controller.py [folder]        # writes results to the folder
"""

import pathlib
import sys
from typing import Any

import numpy

import grapnel


class OwnPd:
    """PD control of the joints, and damping of the base rate."""

    def create(self, setup: grapnel.ControllerSetup) -> None:
        """Called once per run with the scenario's parameters and a description of the robot (unused here)."""
        self.kp, self.kd, self.base_kd = (setup.parameters[name] for name in ("kp", "kd", "base_kd"))

    def reset(self, time: float) -> None:
        """Called before the first sample."""
        self.largest = 0.0

    def update(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess,
               output: grapnel.ControllerOutput) -> None:
        """Called at every sample."""
        output.effort = (self.kp * (input.desired_position - input.position) +
                         self.kd * (input.desired_rate - input.rate))
        output.base_torque = -self.base_kd * input.base_angular_velocity
        # `access` provides H, C, p and J* of servicer and target at this instant; here the kinetic energy of the joints.
        H = access.mass_matrix()
        joints = H[6:6 + input.joints, 6:6 + input.joints]
        self.largest = max(self.largest, float(0.5 * input.rate @ joints @ input.rate))


control: dict[str, Any] = {"period": "10 ms", "delay": "10 ms", "external": True, "base_torque": True,
                           "parameters": {"kp": 20, "kd": 60, "base_kd": 100}}
source = pathlib.Path(__file__).resolve().parents[2]
problem = grapnel.load(source / "examples/controllers/own-controller.yaml", set={"control": control})
pd = OwnPd()
result = problem.simulate(controller=pd)

print(*result.verdict, sep="\n")
rate = result["joints/velocity"]
print(f"largest joint rate: {numpy.abs(rate).max():.3g} rad/s, at the end {numpy.abs(rate[-1]).max():.3g} rad/s")
print(f"maximum kinetic energy of the joints {pd.largest:.3g} J; ledger passed: {result.ledger.passed}")
if len(sys.argv) > 1:
    result.save(sys.argv[1], report=False)
if result.status != "completed" or not result.ledger.passed:
    sys.exit(f"the run {result.status}: {result.failure}")
