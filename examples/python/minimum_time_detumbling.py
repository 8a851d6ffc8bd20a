"""Minimum-time detumbling of a captured satellite with a bounded torque on the base, compared with the built-in controller.

    minimum_time_detumbling.py [folder]        # writes results to the folder

In scenarios/heavy-satellite-detumble.yaml a servicer holds a 6 t satellite in a flat spin. The torque on the base is at most 60 N m
about each axis. The built-in attitude control damps the rate within this bound. The script searches for the shortest time in which
the rigid stack comes to rest: a bisection over the time, to 1 %, with differential dynamic programming for the rate that remains at
its end. The method is local and a plan has 16 constant torques, so the time found is an upper bound of the minimum time.
In the simulation the plan is computed again every four seconds for the remaining time. The joints hold by computed torque in both
runs: the springs of PD control would swing back after a torque that changes its sign.
"""

import pathlib
import sys
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

import grapnel
from grapnel import optimal_control as oc

PERIOD, STEPS, REPLAN = 0.02, 16, 4.0  # of the control [s]; number of steps of a plan; time between plans [s]
TORQUE = 60.0  # bound about each axis of the base [N m]
DEGREE = np.pi / 180
REST = 0.002 * DEGREE  # rate at which a plan counts as detumbled [rad/s]
Array = NDArray[Any]
source = pathlib.Path(__file__).resolve().parents[2]
gains = {"kp": 4.0, "kd": 4.0}  # of the joints' computed torque in both runs [1/s^2, 1/s]


def load(**values: Any) -> grapnel.Problem:
    """The scenario with sampled control."""
    return grapnel.load(source / "scenarios/heavy-satellite-detumble.yaml", set={"post_impact.duration": 70, "output.interval": 0.1, **values})


def stack_after(problem: grapnel.Problem, result: grapnel.Result) -> tuple[grapnel.Robot, Array]:
    """The servicer with its held target, and its state after the impact, with the joints stopped at the same momentum."""
    system = grapnel.Robot(problem, targets=True)
    at, q = int(np.searchsorted(result.time, problem["approach.duration"], side="right")) - 1, system.zero_state()[0]
    for body, series in ((system.base, "base"), ("target:satellite", "targets/satellite")):
        q[system.body_q(body)] = np.concatenate([result[f"{series}/position"][at], result[f"{series}/quaternion_wxyz"][at]])
    q[system.joint_q] = result["joints/position"][at]
    stack = system.holding(q)
    q = q[:stack.nq]
    R, M = stack.frame_pose(stack.base, q)[:3, :3], stack.mass_matrix(q)
    base = np.concatenate([R.T @ result["base/angular_velocity"][at], R.T @ result["base/velocity"][at]])
    v = np.zeros(stack.nv)
    v[:6] = base + np.linalg.solve(M[:6, :6], M[:6, 6:] @ result["joints/velocity"][at])
    return stack, np.concatenate([q, v])


class Detumbling:
    """Plans for the rigid stack with bounded torques."""

    def __init__(self, stack: grapnel.Robot) -> None:
        self.stack = stack

    def plan(self, x: Array, duration: float, guess: Array, iterations: int = 25) -> tuple[oc.Plan, Array]:
        """Torques (STEPS, 3) within the bounds that leave the least rate after a duration, and that rate."""
        dynamics = oc.DiscreteDynamics(self.stack, duration / STEPS, inputs=["base_torque"], locked=self.stack.joints)
        final = np.zeros((dynamics.ndx, dynamics.ndx))
        rates = [dynamics.dx_names.index(f"{self.stack.base}/w{axis}") for axis in "xyz"]
        final[rates, rates] = REST**-2
        # A small cost of the torques: without it the torques of longer durations are not unique.
        cost = oc.TrackingCost(dynamics, 0 * final, 1e-3 / STEPS * np.eye(3) / TORQUE**2, final, dynamics.state(*self.stack.zero_state()))
        plan = oc.ddp(dynamics, cost, x, guess, lower=[-TORQUE] * 3, upper=[TORQUE] * 3, iterations=iterations,
                      tolerance=1e-3)
        return plan, plan.xs[-1, self.stack.nq:][:3]

    def minimum_time(self, x: Array, least: float, most: float) -> tuple[float, oc.Plan]:
        """The shortest duration for which a plan is found, within 1 %; RuntimeError if none is found up to 100 times `most`."""
        best: Optional[oc.Plan] = None
        longest = 100 * most
        h = self.stack.momentum(x[:self.stack.nq], x[self.stack.nq:])[:3]
        R = self.stack.frame_pose(self.stack.base, x[:self.stack.nq])[:3, :3]
        guess = np.tile(-TORQUE * (R.T @ h) / np.abs(R.T @ h).max(), (STEPS, 1))
        while most - least > 0.01 * most or best is None:
            middle = most if best is None else 0.5 * (least + most)
            plan, rate = self.plan(x, middle, guess)
            if float(np.linalg.norm(rate)) < REST:
                most, best, guess = middle, plan, plan.us
            elif best is None:
                least, most = most, 1.5 * most
                if most > longest:
                    raise RuntimeError(f"no plan comes to rest within {least:.3g} s")
            else:
                least = middle
        return most, best


class Planned:
    """Torque of the plan for the remaining time, then damping; computed torque of the joints."""

    def __init__(self, detumbling: Detumbling, duration: float, plan: oc.Plan) -> None:
        self.detumbling, self.duration, self.us = detumbling, duration, plan.us
        self.begin, self.planned = np.nan, -np.inf
        self.left = duration

    def update(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess, output: grapnel.ControllerOutput) -> None:
        """Called at every sample."""
        if np.isnan(self.begin):
            self.begin = self.planned = input.time
        remaining = self.begin + self.duration - input.time
        if input.time > self.planned + REPLAN - 1e-9 and remaining > REPLAN:
            self.us, self.planned, self.left = self.replan(input, access, remaining), input.time, remaining
        if remaining > 1e-9:
            output.base_torque = self.us[min(int((input.time - self.planned + 1e-9) / self.left * STEPS), STEPS - 1)]
        else:
            output.base_torque = np.clip(-4000 * input.base_angular_velocity, -TORQUE, TORQUE)
        # Accelerations of the joints are given, that of the base follows.
        H, c = access.mass_matrix(), access.bias()
        wanted = gains["kp"] * (input.desired_position - input.position) - gains["kd"] * input.rate
        base = np.linalg.solve(H[:6, :6], np.concatenate([output.base_torque, np.zeros(3)]) - c[:6] - H[:6, 6:] @ wanted)
        output.effort = H[6:, 6:] @ wanted + H[6:, :6] @ base + c[6:]

    def replan(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess, remaining: float) -> Array:
        """The torques for the remaining time from the measured momentum, as if the joints stopped."""
        stack, H = self.detumbling.stack, access.mass_matrix()
        q, v = stack.zero_state()
        q[:7], q[stack.joint_q] = np.concatenate([input.base_position, input.base_quaternion_wxyz]), input.position
        R = stack.frame_pose(stack.base, q)[:3, :3]
        v[:6] = np.concatenate([input.base_angular_velocity, R.T @ input.base_velocity]) + np.linalg.solve(H[:6, :6], H[:6, 6:] @ input.rate)
        shift = np.minimum(((np.arange(STEPS) + 0.5) / STEPS * remaining + self.left - remaining) / self.left * STEPS, STEPS - 1).astype(int)
        return self.detumbling.plan(np.concatenate([q, v]), remaining, self.us[shift], iterations=8)[0].us


def measures(result: grapnel.Result, begin: float) -> dict[str, float]:
    """Times after the capture at which the rates of base and satellite remain below limits, and the use of the torque."""
    after = result.time > begin
    time, step = result.time[after], 0.1
    rate = np.maximum(*(np.linalg.norm(result[f"{body}/angular_velocity"][after], axis=1) for body in ("base", "targets/satellite"))) / DEGREE
    torque, effort = result["base/control_torque"][after], np.abs(result["joints/effort"][after])

    def until(limit: float) -> float:
        return float(time[rate > limit][-1] - begin)
    return {"below 0.2 deg/s after [s]": until(0.2), "below 0.05 deg/s after [s]": until(0.05), "below 0.01 deg/s after [s]": until(0.01),
            "angular impulse [N m s]": float(np.sum(np.linalg.norm(torque, axis=1)) * step), "peak base torque [N m]": np.abs(torque).max(),
            "peak joint effort [N m]": effort.max()}


if __name__ == "__main__":
    own = load(**{"control": {"period": PERIOD}, "post_impact.joints": "computed_torque", "post_impact.kp": gains["kp"], "post_impact.kd": gains["kd"],
                  "post_impact.base_control.limit": TORQUE})
    results = {"own": own.simulate(strict=True)}
    begin = float(own["approach.duration"])
    stack, x = stack_after(own, results["own"])
    h = float(np.linalg.norm(stack.momentum(x[:stack.nq], x[stack.nq:])[:3]))
    bound = h / (np.sqrt(3) * TORQUE)
    duration, plan = Detumbling(stack).minimum_time(x, bound, 1.5 * h / TORQUE)
    print(f"angular momentum of the stack {h:.1f} N m s")
    print(f"lower bound |h| / (sqrt(3) 60 N m) of the time {bound:.2f} s; |h| / 60 N m = {h / TORQUE:.2f} s")
    at_bound = np.mean(np.abs(plan.us) > 0.99 * TORQUE)
    print(f"upper bound of the minimum time of the rigid stack {duration:.2f} s, {at_bound:.0%} of the torques at their bound")
    planned = load(**{"control": {"period": PERIOD, "external": True, "base_torque": True},
                      "post_impact": {"duration": own["post_impact.duration"], "joints": "controller"}})
    results["planned"] = planned.simulate(controller=Planned(Detumbling(stack), duration, plan), strict=True)
    table = {name: measures(result, begin) for name, result in results.items()}
    print(f"\n{'':30}{'own':>10}{'planned':>10}  better")
    for row in table["own"]:
        a, b = table["own"][row], table["planned"][row]
        print(f"{row:30}{a:10.4g}{b:10.4g}  {'planned' if b < 0.99 * a else 'own' if a < 0.99 * b else 'equal'}")
    for name, result in results.items():
        print(f"{name}: captured {result.captured}, ledger passed: {result.ledger.passed}")
        if len(sys.argv) > 1:
            result.save(pathlib.Path(sys.argv[1]) / name, report=False)
