"""The capture of scenarios/planar-caging.yaml with the controller of its publication, without impedance control: A.
Uchida, K. Uno, K. Yoshida, Space debris reliable capturing by a dual-arm orbital robot, 2024 (arXiv 2405.00943).

    published_controller.py [folder] [--spin 3] [--closing 0.6] [--duration 6]     # writes results to the folder

The controller demands joint rates with which the grippers move along straight lines in W, whatever the momentum is, and
efforts with which the error of the rates vanishes within a sample. It does not compensate contact forces.
"""

import argparse
import math
import pathlib

import numpy
from numpy.typing import NDArray

import grapnel

PERIOD = 0.001  # [s]
SHOULDER = (0.16, 0.08)  # of the right arm, in the base's frame; the left one is its mirror image [m]
LENGTHS = (0.25, 0.18, 0.13655, 0.056556)  # of the links, and from the wrist to the end-effector's frame [m]
WIDTH, RADIUS, HALF_FORK = 0.15, 0.015, 0.0397488  # of the square, of a ball, half the distance of two balls [m]
START = (0.19840076, 0.385)  # point between the balls of the right gripper in the initial posture, in W [m]
MOVING = [0, 1, 2, 4, 5, 6]  # joints whose rates the gripper's motion defines; the wrists' are zero


def rotated(angle: float, vector: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
    """A vector of the plane, rotated by an angle [rad]."""
    c, s = math.cos(angle), math.sin(angle)
    return numpy.array([c * vector[0] - s * vector[1], s * vector[0] + c * vector[1]])


def waiting_time(spin: float) -> float:
    """First time after 1 s at which a corner of the square is between two balls [s]. `spin`: its rate > 0 [rad/s]."""
    angle = math.pi / 4 - math.asin(HALF_FORK / (WIDTH / math.sqrt(2) + RADIUS))
    while angle < spin:
        angle += math.pi / 2
    return angle / spin


class PublishedController:
    """Straight motions with cubic profiles: to the waiting positions, then around the square."""

    def __init__(self, waiting: float, closing: float) -> None:
        """`waiting`, `closing`: durations of both motions [s]."""
        corner = WIDTH / math.sqrt(2) + RADIUS
        wait = 1.03 * math.sqrt(corner**2 - HALF_FORK**2), 0.35
        closed = 1.05 * (WIDTH + 2 * RADIUS) / math.sqrt(2) - HALF_FORK, 0.35
        self.points = numpy.array([START, wait, closed])
        self.times = numpy.array([0, waiting, waiting + closing])

    def velocity(self, time: float) -> NDArray[numpy.float64]:
        """Velocity of the right gripper in W [m/s]."""
        k = int(numpy.searchsorted(self.times, time, side="right")) - 1
        if k >= 2:
            return numpy.zeros(2)
        duration = self.times[k + 1] - self.times[k]
        s = (time - self.times[k]) / duration
        return 6 * s * (1 - s) / duration * (self.points[k + 1] - self.points[k])

    def update(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess,
               output: grapnel.ControllerOutput) -> None:
        """H, c and the joint rates => efforts of the robot reduced to its joints, for zero error after one sample."""
        H, c = access.mass_matrix(), access.bias()
        coupling = numpy.linalg.solve(H[:6, :6], numpy.column_stack([H[:6, 6:], c[:6]]))
        inertia = H[6:, 6:] - H[6:, :6] @ coupling[:, :-1]
        bias = c[6:] - H[6:, :6] @ coupling[:, -1]
        rates = numpy.zeros(input.joints)
        if input.time < self.times[-1] + PERIOD:  # the published program holds the joints one step later
            rates[MOVING] = self.gripper_rates(input, access, coupling[:, :-1])
        output.effort = inertia @ (rates - input.rate) / PERIOD + bias

    def gripper_rates(self, input: grapnel.ControllerInput, access: grapnel.ControllerAccess,
                      coupling: NDArray[numpy.float64]) -> NDArray[numpy.float64]:
        """Velocities of both grippers in W, less those by the momentum => joint rates by the generalized Jacobian."""
        w, _, _, z = input.base_quaternion_wxyz
        attitude = 2 * math.atan2(z, w)
        by_momentum = coupling @ input.rate  # [angular; linear] of the base in its axes, with the joints at rest
        by_momentum[2] += input.base_angular_velocity[2]
        base_velocity = input.base_velocity[:2] + rotated(attitude, by_momentum[3:5])
        jacobian, wanted = numpy.empty((6, 6)), numpy.empty(6)
        for arm, (name, side) in enumerate((("left", -1), ("right", 1))):
            angle = attitude
            lever = rotated(angle, numpy.array([side * SHOULDER[0], SHOULDER[1]]))  # from the base to the gripper
            for length, joint in zip(LENGTHS, input.position[4 * arm:4 * arm + 4]):
                angle += joint
                lever = lever + rotated(angle, numpy.array([0, length]))
            carried = base_velocity + by_momentum[2] * numpy.array([-lever[1], lever[0]])
            rows = slice(3 * arm, 3 * arm + 3)  # rate about z, velocities along x and y
            jacobian[rows] = access.generalized_jacobian(name)[2:5, MOVING]
            wanted[rows] = [-by_momentum[2], *(self.velocity(input.time) * [side, 1] - carried)]
        return numpy.linalg.solve(jacobian, wanted)


def capture(spin: float, closing: float, duration: float, **values: object) -> grapnel.Result:
    """The capture of a square with the rate `spin` [rad/s]; `duration`: after closing [s]; other values by path."""
    waiting = waiting_time(spin)
    scenario = pathlib.Path(__file__).resolve().parents[2] / "scenarios/planar-caging.yaml"
    problem = grapnel.load(scenario, set={
        "targets[0].state.angular_velocity": [0, 0, spin],
        "approach.pieces[0].until": waiting, "approach.pieces[1].until": waiting + closing,
        "approach.tracking": {"mode": "controller"},
        "motion": {"name": "caged", "duration": duration, "joints": "controller"},
        "control": {"period": PERIOD, "external": True}, "output.interval": 0.0005, **values})
    return problem.simulate(controller=PublishedController(waiting, closing))


def force_on(result: grapnel.Result, gripper: str) -> NDArray[numpy.float64]:
    """Magnitude of the contact force on a gripper at the samples [N]."""
    return numpy.linalg.norm(result[f"contacts/{gripper}-hand--square/force"], axis=1)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="The published planar capture, with its controller.")
    parser.add_argument("folder", nargs="?", help="for the results")
    parser.add_argument("--spin", type=float, default=1.0, help="of the square [rad/s]")
    parser.add_argument("--closing", type=float, default=0.5, help="duration of the closing motion [s]")
    parser.add_argument("--duration", type=float, default=6.0, help="of the motion after closing [s]")
    chosen = parser.parse_args()
    result = capture(chosen.spin, chosen.closing, chosen.duration)
    for gripper, pair in zip(("left", "right"), result.summary["contacts"]):
        force = force_on(result, gripper)
        print(f"{gripper} gripper: {pair['touches']} touches, largest force {force.max():.5f} N "
              f"at t = {result.time[force.argmax()]:.4f} s")
    print(f"spin of the square at the end: {result['targets/square/angular_velocity'][-1][2]:.5f} rad/s")
    if chosen.folder:
        result.save(chosen.folder, report=False)
