"""Capture of tumbling satellites by space robots: approach, impact, and motion afterwards.

    import grapnel
    problem = grapnel.load("scenarios/dual-arm-satellite-handles.yaml", set={"approach.duration": 50})
    problem.targets[0].mass = 130                       # any value of the scenario, by attribute or by path
    result = problem.simulate()
    print(result.captured, result.units["base/angular_velocity"], result["base/angular_velocity"][-1])
    result.report("capture.html")

All values are in SI units and radians. Frames: W is the inertial world, B the robot's base, E an end-effector, T a target.
Twists and wrenches are [angular; linear]. Quaternions are (w, x, y, z). docs/python.md is the manual.
"""

from . import data, env, optimal_control
from ._grapnel import Check, Fault, InputError, __version__, instruction_set
from .commands import CommandError, campaign, figure, optimize, report, success_map, sweep
from .controller import Controller, ControllerAccess, ControllerInput, ControllerOutput, ControllerSetup
from .identify import Identification, identify
from .linear import LinearModel
from .logs import Comparison, FittedParameters, GraspImpulse, MeasuredContact, MeasuredImpulses, Residuals, compare, identify_from_logs, impulses
from .progress import Progress
from .result import Ledger, Result, SimulationError
from .robot import (ForwardDynamicsDerivatives, Impact, InverseDynamicsDerivatives, LoopDynamicsDerivatives, Loops, Robot, Rollout,
                    rollout)
from .scenario import Problem, Scenario, Values, check, load, simulate_many
from .sensitivities import Sensitivities, campaign_sensitivities
from .tables import read_columns, read_table

__all__ = [
    "Check", "CommandError", "Comparison", "Controller", "ControllerAccess", "ControllerInput", "ControllerOutput", "ControllerSetup",
    "Fault", "FittedParameters", "ForwardDynamicsDerivatives", "GraspImpulse", "Identification", "Impact", "InputError",
    "InverseDynamicsDerivatives", "Ledger", "LinearModel", "LoopDynamicsDerivatives", "Loops", "MeasuredContact", "MeasuredImpulses",
    "Problem", "Progress", "Residuals", "Result", "Robot", "Rollout", "Scenario", "Sensitivities", "SimulationError", "Values",
    "__version__", "campaign", "campaign_sensitivities", "check", "compare", "env", "figure", "identify", "identify_from_logs",
    "impulses", "instruction_set", "load", "optimal_control", "optimize", "read_columns", "read_table", "report", "rollout",
    "simulate_many", "success_map", "sweep",
]
