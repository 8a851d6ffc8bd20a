"""Rollouts: comparison with a separate integrator, convergence order, conservation, independence of batch and threads."""

import numpy as np
import pytest
from conftest import SOURCE, SPATIAL, THESIS
from robot_test import states

import grapnel


@pytest.fixture(scope="module")
def robot():
    return grapnel.Robot(SPATIAL)


@pytest.fixture(scope="module")
def system():
    return grapnel.Robot(grapnel.load(THESIS), targets=True)


def control_of(robot, n, steps, seed=7):
    return np.random.default_rng(seed).uniform(-3, 3, (n, steps, robot.nu))


def reference(robot, state, control, step):
    """The classic Runge-Kutta method with the library's forward dynamics, for one state, from the definition of q and v."""
    nq = robot.nq

    def derivative(x, tau):
        q, v = x[:nq], x[nq:]
        unit, rate = q.copy(), np.zeros(nq)
        for body in robot.bodies:
            if robot.body_q(body) is None:
                continue
            at, u = robot.body_q(body), v[robot.body_v(body)]
            w, a, b, c = q[at][3:]
            unit[at][3:] /= np.linalg.norm(unit[at][3:])
            rate[at][3:] = 0.5 * np.array([-a * u[0] - b * u[1] - c * u[2], w * u[0] + b * u[2] - c * u[1],
                                           w * u[1] + c * u[0] - a * u[2], w * u[2] + a * u[1] - b * u[0]])
            rate[at][:3] = robot.frame_pose(body, unit)[:3, :3] @ u[3:]
        rate[robot.joint_q] = v[robot.joint_v]
        return np.concatenate([rate, robot.forward_dynamics(unit, v, tau)])

    out = []
    for tau in control:
        k1 = derivative(state, tau)
        k2 = derivative(state + 0.5 * step * k1, tau)
        k3 = derivative(state + 0.5 * step * k2, tau)
        k4 = derivative(state + step * k3, tau)
        state = state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        for body in robot.bodies:
            if robot.body_q(body) is not None:
                quaternion = state[robot.body_q(body)][3:]
                quaternion /= np.linalg.norm(quaternion)
        out.append(state)
    return np.array(out)


def test_rk4_is_the_classic_method(robot):
    q, v = states(robot, 3)
    start, control = np.concatenate([q, v], axis=1), control_of(robot, 3, 20)
    found = grapnel.rollout(robot, start, control, step=0.01, friction=False)
    assert found.shape == (3, 20, robot.nq + robot.nv)
    for i in range(3):
        # Stages differ by the norm of quaternions within a step, an effect of higher order.
        expected = reference(robot, start[i], control[i], 0.01)
        assert np.abs(found[i] - expected).max() < 1e-7  # measured 3e-9


@pytest.mark.parametrize("method, order", [("rk4", 4), ("euler", 1)])
def test_the_order_of_convergence(robot, method, order):
    q, v = states(robot, 2)
    start, control = np.concatenate([q, 0.5 * v], axis=1), control_of(robot, 2, 4)
    end = [grapnel.rollout(robot, start, control, step=0.2 / k, substeps=k, method=method, friction=False,
                           last_only=True)
           for k in (64, 128, 1024)]
    coarse, fine = (np.abs(x - end[2]).max() for x in end[:2])
    assert fine > 1e-11  # above rounding error
    # Compared with a solution with eight times smaller steps: 2^p, or slightly more.
    assert 0.8 * 2**order < coarse / fine < 1.3 * 2**order


def test_momentum_is_conserved(system):
    q, v = system.initial_state()
    start = np.tile(np.concatenate([q, v]), (9, 1))
    control = control_of(system, 9, 100)
    end = grapnel.rollout(system, start, control, step=0.01, last_only=True)
    before, after = system.momentum(q, v, about=[0, 0, 0]), system.momentum(end[:, :system.nq], end[:, system.nq:], about=[0, 0, 0])
    assert np.linalg.norm(before) > 0.1
    assert np.abs(after - before).max() < 1e-6 and np.abs(end[:, system.joint_q] - q[system.joint_q]).max() > 0.01


def test_cases_are_independent(system):
    q, v = system.initial_state()
    n = 37
    start = np.tile(np.concatenate([q, v]), (n, 1)) + 0
    start[:, system.nq:] += 0.1 * np.random.default_rng(1).standard_normal((n, system.nv))
    control = control_of(system, n, 5)
    together = grapnel.rollout(system, start, control, step=0.02, substeps=3)
    for threads in (1, 3):
        assert np.array_equal(together, grapnel.rollout(system, start, control, step=0.02, substeps=3, threads=threads))
    for i in (0, 8, 36):
        assert np.array_equal(together[i], grapnel.rollout(system, start[i:i + 1], control[i:i + 1], step=0.02, substeps=3)[0])
    assert np.array_equal(together[:, -1], grapnel.rollout(system, start, control, step=0.02, substeps=3, last_only=True))
    # One control for three steps equals three equal controls.
    twice = grapnel.rollout(system, start, np.repeat(control, 3, axis=1), step=0.02)
    assert np.array_equal(together, twice[:, 2::3])


def test_a_rollout_of_a_problem_is_its_free_motion():
    problem = grapnel.load(THESIS, set={"post_impact.joints": "free", "post_impact.duration": 2, "approach.duration": 2})
    result = problem.simulate()
    # Without drives after the impact, fixed steps give the same motion. A rollout has no grasps, so the test compares a
    # target before the impact.
    rollout = grapnel.Rollout(problem, step=0.01, substeps=10)
    q, v = rollout.robot.initial_state()
    states_ = rollout(rollout.state(q, v)[None], steps=10)[0]
    at = rollout.robot.body_q("target:target-1")
    sample = int(np.argmin(np.abs(result.time - 1.0)))
    assert result.time[sample] == pytest.approx(1.0, abs=1e-12)
    assert np.allclose(states_[9, at][:3], result["targets/target-1/position"][sample], atol=1e-9)
    assert np.allclose(states_[9, at][3:], result["targets/target-1/quaternion_wxyz"][sample], atol=1e-9)


def test_friction_efforts_and_gravity(tmp_path):
    text = (SOURCE / "robots/planar-dual-arm.yaml").read_text(encoding="utf-8")
    file = tmp_path / "robot.yaml"
    file.write_text(text.replace("name: arm-1-joint-1, type: revolute,",
                                 "name: arm-1-joint-1, type: revolute, limits: {effort: 2}, friction: {viscous: 3},"),
                    encoding="utf-8")
    robot = grapnel.Robot(file)
    q, v = robot.zero_state()
    v[robot.joint_v[0]] = 0.5
    start = np.concatenate([q, v])[None]
    control = np.zeros((1, 1, robot.nu))
    control[0, 0, 0] = 10
    step = 1e-6
    after = grapnel.rollout(robot, start, control, step=step)[0, 0, robot.nq:]
    tau = np.zeros(robot.nu)
    tau[0] = 2 - 3 * 0.5  # saturated at the limit, minus friction
    assert np.allclose((after - v) / step, robot.forward_dynamics(q, v, tau), atol=1e-6)
    smooth = grapnel.rollout(robot, start, control, step=step, friction=False)[0, 0, robot.nq:]
    tau[0] = 2
    assert np.allclose((smooth - v) / step, robot.forward_dynamics(q, v, tau), atol=1e-6)
    falling = grapnel.rollout(robot, np.concatenate([q, 0 * v])[None], step=0.1, steps=10, gravity=[0, 0, -2])[0, -1]
    assert np.allclose(falling[:3], [0, 0, -1.0], atol=1e-9)


def test_a_held_base_stays():
    problem = grapnel.load(THESIS, set={"robot.base.mode": "held"})
    rollout = grapnel.Rollout(problem, step=0.02)
    q, v = rollout.robot.initial_state()
    end = rollout(rollout.state(q, v)[None], control_of(rollout.robot, 1, 50))[0, -1]
    assert np.array_equal(end[:7], q[:7]) and np.abs(end[rollout.robot.joint_q] - q[rollout.robot.joint_q]).max() > 0.01


@pytest.mark.parametrize("call, message", [
    (lambda r, x, u: grapnel.rollout(r, x[0, 1:], u, step=0.1), r"initial_state has shape \(2, 40\), expected \(n, 41\)"),
    (lambda r, x, u: grapnel.rollout(r, x[:, None], u, step=0.1), r"initial_state has shape \(2, 1, 41\)"),
    (lambda r, x, u: grapnel.rollout(r, x, u[:, 0], step=0.1), r"control has shape \(2, 14\), expected \(2, steps, 14\)"),
    (lambda r, x, u: grapnel.rollout(r, x, u[:1], step=0.1), r"control has shape \(1, 3, 14\)"),
    (lambda r, x, u: grapnel.rollout(r, x, step=0.1), "neither control nor steps"),
    (lambda r, x, u: grapnel.rollout(r, x, u[:, :0], step=0.1), "there are 0 steps"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=0.1, steps=4), r"steps is 4, but control has shape \(2, 3, 14\)"),
    (lambda r, x, u: grapnel.rollout(r, x, step=0.1, steps=-2), "steps is -2"),
    (lambda r, x, u: grapnel.rollout(r, x, step=0.1, steps=2**70), "steps is"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=0.1, threads=2**70), "threads is"),
    (lambda r, x, u: grapnel.Rollout(r, 0.1).state(x[0, :3], x[0, 21:]), r"q has shape \(3,\)"),
    (lambda r, x, u: grapnel.Rollout(r, 0.1).split(x[0, :3]), r"state has shape \(3,\)"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=0), "step must be positive"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=np.nan), "step must be positive"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=0.1, substeps=0), "substeps is 0"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=0.1, method="rk5"), "method is 'rk5'; did you mean 'rk4'"),
    (lambda r, x, u: grapnel.rollout(r, x, u * np.nan, step=0.1), r"control\[0, 0, 0\] is nan"),
    (lambda r, x, u: grapnel.rollout(r, 2 * x, u, step=0.1), "norm 2"),
    (lambda r, x, u: grapnel.rollout(r, x, u, step=0.1, threads=-1), "threads is -1"),
])
def test_wrong_arguments_are_named(robot, call, message):
    x = np.tile(np.concatenate(robot.zero_state()), (2, 1))
    with pytest.raises(ValueError, match=message):
        call(robot, x, np.zeros((2, 3, robot.nu)))


def test_one_state_and_one_sequence_of_controls(robot):
    rollout = grapnel.Rollout(robot, 0.02)
    x, control = rollout.state(*robot.zero_state()), control_of(robot, 3, 4)
    many = rollout(x, control)
    assert many.shape == (3, 4, rollout.nstate)
    assert np.array_equal(many, rollout(np.tile(x, (3, 1)), control))
    assert np.array_equal(many[1], rollout(x, control[1]))
    assert np.array_equal(many[1, -1], rollout(x, control[1], last_only=True))
    assert rollout(x, steps=5).shape == (5, rollout.nstate)
    q, v = rollout.split(many)
    assert np.shares_memory(q, many) and np.array_equal(rollout.state(q, v), many)
    assert rollout.state(q[0, 0], v[0]).shape == (4, rollout.nstate)


@pytest.mark.parametrize("call", [lambda r: grapnel.Rollout(r, 0.1, method=None), lambda r: grapnel.Rollout(r, 0.1, substeps=2.5),
                                  lambda r: grapnel.Rollout(r, None), lambda r: grapnel.Rollout(r, 0.1)(np.zeros(41), steps=2.7)])
def test_wrong_types_are_rejected_with_a_message(robot, call):
    with pytest.raises(TypeError) as raised:
        call(robot)
    assert "incompatible" not in str(raised.value)  # not the message of pybind11


def test_an_overflow_is_not_a_number(robot):
    q, v = robot.zero_state()
    start = np.tile(np.concatenate([q, v]), (2, 1))
    start[1, robot.nq:] = 1e200
    end = grapnel.rollout(robot, start, step=1.0, steps=5)
    assert np.all(np.isfinite(end[0])) and not np.all(np.isfinite(end[1]))


def test_zero_cases_give_zero_states(robot):
    assert grapnel.rollout(robot, np.zeros((0, robot.nq + robot.nv)), step=0.1, steps=4).shape == (0, 4, robot.nq + robot.nv)
