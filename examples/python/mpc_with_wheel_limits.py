"""Model predictive control within the torques and rates of reaction wheels, compared with the built-in controller.

    mpc_with_wheel_limits.py [folder]        # writes results to the folder

The satellite of scenarios/bias-momentum.yaml brings 95 % of its angular momentum to wheels that are at rest. The minimum-norm
torques of the built-in attitude control drive two wheels to their maximum rates. The predictive controller moves the wheels within
their limits: every two seconds it linearizes the stack along the predicted motion of the next 40 s and solves a quadratic program
with bounds of torques and rates. The joints have the same computed torque in both runs.
"""

import pathlib
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

import grapnel
from grapnel import optimal_control as oc

PERIOD, STEP, STEPS = 0.1, 2.0, 20  # of the joints' control, of the prediction [s], and its number of steps
DEGREE = np.pi / 180
Array = NDArray[Any]
source = pathlib.Path(__file__).resolve().parents[2]


def load(**values: Any) -> grapnel.Problem:
    """The scenario with wheels at rest."""
    spin = 0.95 * DEGREE * np.array([0.5, -1, 1])
    return grapnel.load(source / "scenarios/bias-momentum.yaml",
                        set={"initial.wheel_rates": [0, 0, 0, 0], "targets[0].state.angular_velocity": spin.tolist(), **values})


def stack_after(problem: grapnel.Problem, result: grapnel.Result) -> grapnel.Robot:
    """The servicer with its held target in the configuration of the capture."""
    system = grapnel.Robot(problem, targets=True)
    at, q = int(np.searchsorted(result.time, problem["approach.duration"])), system.zero_state()[0]
    for body, series in ((system.base, "base"), ("target:satellite", "targets/satellite")):
        q[system.body_q(body)] = np.concatenate([result[f"{series}/position"][at], result[f"{series}/quaternion_wxyz"][at]])
    for name, value in zip(result.components["joints/position"], result["joints/position"][at]):
        q[system.q_names.index(name)] = value
    return system.holding(q)


class Predictive:
    """Wheel torques by the quadratic program, joint efforts by computed torque."""

    def __init__(self, stack: grapnel.Robot, problem: grapnel.Problem) -> None:
        arm = [name for name in stack.joints if not name.startswith("wheel:")]
        self.dynamics = oc.DiscreteDynamics(stack, STEP, locked=arm)
        self.kp, self.kd = problem["post_impact.kp"], problem["post_impact.kd"]
        self.rate = np.array([wheel["rate"] for wheel in problem["robot.wheels"]])
        # Attitude and rate of the base have costs. Those of the final state are the regulator's cost of the linear model at rest.
        names = self.dynamics.dx_names
        controlled = [names.index(f"{kind}{stack.base}/w{axis}") for kind in ("displacement:", "") for axis in "xyz"]
        running, R = np.diag([(0.02 * DEGREE)**-2] * 3 + [(0.01 * DEGREE)**-2] * 3), np.eye(self.dynamics.nu) / 0.2**2
        self.goal = self.dynamics.state(*stack.zero_state())
        _, A, B = self.dynamics.derivatives(self.goal, np.zeros(self.dynamics.nu))
        regulator = oc.dlqr(A[np.ix_(controlled, controlled)], B[controlled], running, R)
        Q, Q_final = np.zeros((2, len(names), len(names)))
        Q[np.ix_(controlled, controlled)], Q_final[np.ix_(controlled, controlled)] = running, regulator.P
        self.cost = oc.TrackingCost(self.dynamics, Q, R, Q_final, self.goal)
        self.rows = [names.index(name) for name in names if name.startswith("wheel:")]  # of dx
        self.columns = [stack.nq + i for i, name in enumerate(stack.v_names) if name.startswith("wheel:")]  # of x
        self.us, self.torque, self.next = np.zeros((STEPS, self.dynamics.nu)), np.zeros(self.dynamics.nu), -np.inf
        self.residual, self.solved = 0.0, 0

    def state(self, input: grapnel.ControllerInput, by_joints: Array) -> Array:
        """x of the readings with the arm at rest: `by_joints` is the change of the base's velocity when the joints stop."""
        robot = self.dynamics.robot
        q, v = robot.zero_state()
        values = dict(zip(robot.joints, np.concatenate([input.position, np.zeros(len(input.wheel_rate))])))
        rates = dict(zip(robot.joints, np.concatenate([np.zeros(input.joints), input.wheel_rate])))
        q[robot.joint_q], v[robot.joint_v] = [values[name] for name in robot.joints], [rates[name] for name in robot.joints]
        base = np.concatenate([input.base_position, input.base_quaternion_wxyz])
        q[robot.body_q(robot.base)] = base
        R = robot.frame_pose(robot.base, q)[:3, :3]
        v[robot.body_v(robot.base)] = np.concatenate([input.base_angular_velocity, R.T @ input.base_velocity]) + by_joints
        return self.dynamics.state(q, v)

    def plan(self, x: Array) -> Array:
        """The first torques of the optimal change of the predicted motion."""
        us, torque = self.us, np.tile(self.dynamics.upper, STEPS)
        xs = self.dynamics.rollout(x, us)
        P, q, G = oc.condense(self.dynamics, self.cost, xs, us)
        rates = xs[1:, self.columns].ravel()
        room = np.maximum(np.abs(rates), np.tile(0.99 * self.rate, STEPS))  # a rate beyond its limit must have a solution
        rows = np.concatenate([np.eye(us.size), G[1:, self.rows].reshape(-1, us.size)])
        solution = oc.solve_qp(P, q, rows, np.concatenate([-torque - us.ravel(), -room - rates]),
                               np.concatenate([torque - us.ravel(), room - rates]), tolerance=1e-6)
        self.residual, self.solved = max(self.residual, solution.residual), self.solved + 1
        us = np.clip(us + solution.x.reshape(us.shape), self.dynamics.lower, self.dynamics.upper)
        self.us = np.concatenate([us[1:], np.zeros_like(us[:1])])
        return np.asarray(us[0])

    def update(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess, output: grapnel.ControllerOutput) -> None:
        """Called at every sample."""
        H, c, n = access.mass_matrix(), access.bias(), input.joints
        joints = slice(6, 6 + n)
        if input.time >= self.next - 1e-9:
            by_joints = np.linalg.solve(H[:6, :6], H[:6, joints] @ input.rate)
            self.torque, self.next = self.plan(self.state(input, by_joints)), input.time + STEP
        output.wheel_torque = self.torque
        # Computed torque: accelerations of the joints are given, those of base and wheels follow.
        other = np.r_[0:6, 6 + n:len(c)]
        wanted = self.kp * (input.desired_position - input.position) - self.kd * input.rate
        given = np.concatenate([np.zeros(6), self.torque])[:len(other)]
        follow = np.linalg.solve(H[np.ix_(other, other)], given - c[other] - H[other, joints] @ wanted)
        output.effort = H[joints, joints] @ wanted + H[joints, other] @ follow + c[joints]


def measures(result: grapnel.Result, begin: float, limit: float) -> dict[str, float]:
    """Settling time, errors and use of the wheels after the capture."""
    after = result.time > begin
    time, step = result.time[after], float(np.median(np.diff(result.time[after])))
    attitude = 2 * np.arcsin(np.minimum(1, np.linalg.norm(result["base/quaternion_wxyz"][after][:, 1:], axis=1))) / DEGREE
    rate = np.linalg.norm(result["base/angular_velocity"][after], axis=1) / DEGREE
    wheels, torque = np.abs(result["wheels/rate"][after]), result["wheels/torque"][after]
    moving = (attitude > 0.05) | (rate > 0.005)
    return {"settling time [s]": float(time[moving][-1] - begin), "peak attitude error [deg]": attitude.max(),
            "final attitude error [deg]": attitude[-1], "peak base rate [deg/s]": rate.max(), "peak wheel rate [rad/s]": wheels.max(),
            "time of wheels at the limit [s]": float(np.sum(wheels > 0.999 * limit) * step), "peak wheel torque [N m]": np.abs(torque).max(),
            "wheel torque^2 [N^2 m^2 s]": float(np.sum(torque**2) * step)}


if __name__ == "__main__":
    own = load(control={"period": PERIOD})
    results = {"own": own.simulate(strict=True)}
    controller = Predictive(stack_after(own, results["own"]), own)
    begin = float(own["approach.duration"])
    mpc = load(**{"control": {"period": PERIOD, "external": True, "base_actuators": True},
                  "post_impact": {"duration": own["post_impact.duration"], "joints": "controller"}})
    results["MPC"] = mpc.simulate(controller=controller, strict=True)
    print(f"{controller.solved} quadratic programs of {STEPS * controller.dynamics.nu} torques, all solved: {controller.residual < 1e-6}")
    table = {name: measures(result, begin, controller.rate.min()) for name, result in results.items()}
    print(f"\n{'':34}{'own':>10}{'MPC':>10}  better")
    for row in table["own"]:
        a, b = table["own"][row], table["MPC"][row]
        print(f"{row:34}{a:10.4g}{b:10.4g}  {'MPC' if b < 0.99 * a else 'own' if a < 0.99 * b else 'equal'}")
    for name, result in results.items():
        print(f"{name}: captured {result.captured}, ledger passed: {result.ledger.passed}")
        if len(sys.argv) > 1:
            result.save(pathlib.Path(sys.argv[1]) / name, report=False)
