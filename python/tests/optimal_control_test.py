"""Optimal control: derivatives of steps against differences, Riccati equations, quadratic programs and optimal trajectories
against closed forms and other routes."""

import itertools

import numpy as np
import pytest
from conftest import SOURCE, SPATIAL

import grapnel
from grapnel import optimal_control as oc

HINGE = {"schema": "grapnel-scenario/1", "name": "hinge",
         "robot": {"name": "hinge", "base": {"name": "bench", "mode": "fixed", "mass": 100, "inertia": [10, 10, 10]},
                   "links": [{"name": "arm", "parent": "bench", "mass": 2, "inertia": [0.1, 0.4, 0.5],
                              "joint": {"name": "elbow", "type": "revolute", "axis": [0, 0, 1], "limits": {"effort": 3}}}]},
         "initial": {"joints": [0.3]},
         "motion": [{"name": "hold", "duration": 10, "joints": "pd", "kp": 20, "kd": 1.6}]}


def random_state(dynamics, rng, locked=()):
    robot = dynamics.robot
    q, v = rng.uniform(-1, 1, robot.nq), rng.uniform(-1, 1, robot.nv)
    for body in robot.bodies:
        at = robot.body_q(body)
        if at is not None:
            q[at][3:] /= np.linalg.norm(q[at][3:])
    v[[robot.v_names.index(name) for name in locked]] = 0
    return dynamics.state(q, v)


def differences(function, n, h):
    """Derivative by central differences with Richardson extrapolation, (..., n). `function`: of rows of deviations, (n, n)."""
    def central(h):
        return np.moveaxis((function(h * np.eye(n)) - function(-h * np.eye(n))) / (2 * h), 0, -1)
    return (4 * central(h / 2) - central(h)) / 3


def dual_arm(**values):
    return oc.DiscreteDynamics(grapnel.Robot(SPATIAL), **values)


def system():
    """A servicer with four wheels, and its free target."""
    return oc.DiscreteDynamics(grapnel.load(SOURCE / "scenarios/wheels-keep-attitude.yaml"), 0.05)


@pytest.fixture(scope="module")
def hinge():
    return oc.DiscreteDynamics(grapnel.Robot(grapnel.Scenario(HINGE)), 0.1)


JOINTS = grapnel.Robot(SPATIAL).joints
CASES = {
    "joints": lambda: (dual_arm(step=0.05), []),
    "substeps": lambda: (dual_arm(step=0.1, substeps=2), []),
    "base, gravity, damping": lambda: (dual_arm(step=0.05, inputs=["base_torque", "base_force", *JOINTS[:2]], gravity=[0.3, -0.2, -1],
                                                damping=np.linspace(0, 2, 14)), []),
    "locked": lambda: (dual_arm(step=0.05, locked=JOINTS[:9]), JOINTS[:9]),
    "all locked": lambda: (dual_arm(step=0.5, inputs=["base_torque"], locked=JOINTS), JOINTS),
    "wheels and target": lambda: (system(), []),
}


@pytest.mark.parametrize("name", CASES)
def test_derivatives_of_a_step_agree_with_differences(name):
    dynamics, locked = CASES[name]()
    rng = np.random.default_rng(3)
    x, u = random_state(dynamics, rng, locked), rng.uniform(-1, 1, dynamics.nu)
    after, A, B = dynamics.derivatives(x, u)
    np.testing.assert_allclose(after, dynamics(x, u), rtol=1e-12, atol=1e-12)
    by_state = differences(lambda dx: dynamics.minus(dynamics(dynamics.plus(x, dx), u), after), dynamics.ndx, 2e-3)
    by_input = differences(lambda du: dynamics.minus(dynamics(x, u + du), after), dynamics.nu, 0.1)
    assert np.abs(A - np.eye(dynamics.ndx)).max() > 0.1 and np.abs(B).max() > 1e-5
    assert np.abs(A - by_state).max() < 1e-7 * np.abs(A).max()  # measured at most 4e-10
    assert np.abs(B - by_input).max() < 1e-7 * np.abs(B).max()  # measured at most 6e-9


def test_the_manifold_has_consistent_operations():
    dynamics = system()
    rng = np.random.default_rng(5)
    x, y = random_state(dynamics, rng), random_state(dynamics, rng)
    dx = rng.uniform(-1, 1, dynamics.ndx)
    np.testing.assert_allclose(dynamics.minus(dynamics.plus(x, dx), x), dx, atol=1e-13)
    back = dynamics.plus(x, dynamics.minus(y, x))
    np.testing.assert_allclose(dynamics.minus(back, y), 0, atol=1e-13)
    by_differences = differences(lambda d: dynamics.minus(dynamics.plus(y, d), x), dynamics.ndx, 1e-3)
    np.testing.assert_allclose(dynamics.minus_jacobian(y, x), by_differences, atol=1e-8)
    assert np.abs(by_differences - np.eye(dynamics.ndx)).max() > 0.1
    E = dynamics.tangent(x)
    np.testing.assert_allclose(E, differences(lambda d: dynamics.plus(x, d), dynamics.ndx, 1e-3), atol=1e-8)
    assert len(dynamics.dx_names) == dynamics.ndx and dynamics.dx_names[0] == "displacement:bus/wx"


def test_steps_have_order_four_and_agree_with_rollouts():
    rng = np.random.default_rng(7)
    x = random_state(dual_arm(step=1.0), rng)
    u = rng.uniform(-2, 2, 14)
    exact = dual_arm(step=0.4, substeps=64)(x, u)
    coarse, half = (np.abs(dual_arm(step=0.4, substeps=n)(x, u) - exact).max() for n in (4, 8))
    assert coarse > 1e-9 and 10 < coarse / half < 24  # 2^4
    rollout = grapnel.Rollout(grapnel.Robot(SPATIAL), 0.002, substeps=10, friction=False)
    after = dual_arm(step=0.02, substeps=10)(x, u)
    assert np.abs(after - x).max() > 0.01
    np.testing.assert_allclose(rollout(x, u[None])[0], after, atol=1e-11)  # measured 1e-15


def test_batches_are_their_rows():
    dynamics = dual_arm(step=0.05, inputs=["base_torque", *JOINTS])
    rng = np.random.default_rng(1)
    x, u = np.stack([random_state(dynamics, rng) for _ in range(70)]), rng.uniform(-1, 1, (70, dynamics.nu))
    after, A, B = dynamics.derivatives(x, u)
    np.testing.assert_allclose(dynamics(x, u)[69], dynamics(x[69], u[69]), atol=1e-13)
    for i in (0, 40, 69):
        one = dynamics.derivatives(x[i], u[i])
        np.testing.assert_allclose(after[i], one[0], rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(A[i], one[1], rtol=1e-11, atol=1e-11)
        np.testing.assert_allclose(B[i], one[2], rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(dynamics(x[0], u)[3], dynamics(x[0], u[3]), atol=1e-13)


@pytest.mark.parametrize("call, message", [
    (lambda d, x, u: d(x[:-1], u), r"x has shape \(40,\), expected \(41,\)"),
    (lambda d, x, u: d(x, u[:3]), r"u has shape \(3,\), expected \(14,\)"),
    (lambda d, x, u: d(np.tile(x, (2, 1)), np.tile(u, (3, 1))), "the same number of cases"),
    (lambda d, x, u: d(x * np.nan, u), "x has numbers that are not finite"),
    (lambda d, x, u: d(d.state(x[:21], 100 + x[21:]), u), "choose more substeps"),
    (lambda d, x, u: d(np.where(np.arange(x.size) == 3, 1.1, x), u), "x has a quaternion of norm 1.1; expected 1"),
    (lambda d, x, u: d.derivatives(np.where(np.arange(x.size) == 3, 1 - 2e-6, x), u), "x has a quaternion of norm 0.999998; expected 1"),
    (lambda d, x, u: d.plus(x, u), r"dx has shape \(14,\), expected \(..., 40\)"),
    (lambda d, x, u: dual_arm(step=0), "step is 0"),
    (lambda d, x, u: dual_arm(step=1, inputs=["nothing"]), "no component of v is named 'nothing'"),
    (lambda d, x, u: dual_arm(step=1, inputs=["base_torque", d.robot.v_names[0]]), "inputs has a name twice"),
    (lambda d, x, u: dual_arm(step=1, locked=["nothing"]), "no joint is named 'nothing'"),
    (lambda d, x, u: dual_arm(step=1, damping=[1]), r"damping has shape \(1,\)"),
    (lambda d, x, u: dual_arm(step=1, locked=JOINTS[:1])(d.state(x[:21], 0.1 + x[21:]), u[1:]), "rates of locked joints"),
])
def test_wrong_arguments_are_named(call, message):
    dynamics = dual_arm(step=0.1)
    x = dynamics.state(*dynamics.robot.zero_state())
    with pytest.raises(ValueError, match=message):
        call(dynamics, x, np.zeros(14))


# ---- Riccati equations ----


def test_regulators_have_their_closed_forms():
    regulator = oc.lqr([[0, 1], [0, 0]], [[0], [1]], np.eye(2), [[1]])
    np.testing.assert_allclose(regulator.K, [[1, np.sqrt(3)]], rtol=1e-12)
    # p = a^2 p r / (r + p) + q for scalars.
    a, q, r = 1.2, 0.7, 0.4
    b = r * (1 - a * a) - q
    p = (-b + np.sqrt(b * b + 4 * q * r)) / 2
    np.testing.assert_allclose(oc.dlqr([[a]], [[1]], [[q]], [[r]]).P, [[p]], rtol=1e-12)


@pytest.mark.parametrize("n, m", [(3, 1), (8, 3), (30, 6)])
def test_regulators_minimize_the_cost(n, m):
    rng = np.random.default_rng(n)
    A, B = rng.standard_normal((n, n)) / np.sqrt(n), rng.standard_normal((n, m))
    W = rng.standard_normal((n + m, n + m))
    W = W @ W.T + 0.1 * np.eye(n + m)
    Q, R, N = W[:n, :n], W[n:, n:], W[:n, n:]
    sampled, P = oc.dlqr(A, B, Q, R, N), Q
    for _ in range(2000):  # dynamic programming over a long horizon
        K = np.linalg.solve(R + B.T @ P @ B, B.T @ P @ A + N.T)
        P = A.T @ P @ (A - B @ K) + Q - N @ K
    np.testing.assert_allclose(sampled.K, K, rtol=1e-7, atol=1e-9)
    assert np.abs(sampled.eigenvalues).max() < 1 and sampled.residual < 1e-9
    continuous = oc.lqr(A, B, Q, R, N)
    closed = A - B @ continuous.K
    assert continuous.eigenvalues.real.max() < 0 and continuous.residual < 1e-9
    # The cost x^T P x decreases at the rate of the running cost (Lyapunov equation of the closed loop).
    decrease = closed.T @ continuous.P + continuous.P @ closed
    running = Q + continuous.K.T @ R @ continuous.K - N @ continuous.K - continuous.K.T @ N.T
    np.testing.assert_allclose(decrease, -running, atol=1e-8 * np.abs(running).max())
    try:
        import scipy.linalg as scipy_linalg
    except ImportError:
        return
    np.testing.assert_allclose(continuous.P, scipy_linalg.solve_continuous_are(A, B, Q, R, s=N), rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("solve, A", [(oc.lqr, np.diag([1.0, -1])), (oc.lqr, np.diag([0.0, -1])), (oc.dlqr, np.diag([1.5, 0.2])),
                                      (oc.dlqr, np.diag([1.0, 0.2]))])
def test_systems_without_a_regulator_are_rejected(solve, A):
    with pytest.raises(ValueError, match="no stabilizing solution"):
        solve(A, [[0], [1]], np.eye(2), [[1]])


def test_singular_iterations_have_no_regulator(monkeypatch):
    def singular(*_):
        raise np.linalg.LinAlgError("Singular matrix")
    for solve, name in ((oc.lqr, "inv"), (oc.lqr, "solve"), (oc.dlqr, "solve")):
        with monkeypatch.context() as patch:
            original = np.linalg.solve
            patch.setattr(np.linalg, name, singular if name == "inv" else lambda a, b: original(a, b) if len(a) == 1 else singular())
            with pytest.raises(ValueError, match="no stabilizing solution"):
                solve([[0.5, 1], [0, 0.5]], [[0], [1]], np.eye(2), [[1]])


@pytest.mark.parametrize("Q, R, message", [
    (np.eye(3), [[1]], r"Q has shape \(3, 3\), expected \(2, 2\)"), ([[1, 1], [0, 1]], [[1]], "Q is not symmetric"),
    (np.diag([1, np.inf]), [[1]], "Q has infinite numbers"),
    (np.eye(2), [[0]], "R has an eigenvalue that is not positive"), (-np.eye(2), [[1]], "the cost has no minimum"),
])
def test_wrong_weights_are_named(Q, R, message):
    for solve in (oc.lqr, oc.dlqr):
        with pytest.raises(ValueError, match=message):
            solve(np.eye(2), [[0], [1]], Q, R)


# ---- Quadratic programs ----


def enumerated(H, g, lower, upper):
    """The minimum within bounds by all combinations of active bounds."""
    best, at = np.inf, None
    for choice in itertools.product((-1, 0, 1), repeat=len(g)):
        choice = np.array(choice)
        x = np.where(choice < 0, lower, upper).astype(float)
        free = choice == 0
        if np.any(free):
            x[free] = np.linalg.solve(H[np.ix_(free, free)], -g[free] - H[np.ix_(free, ~free)] @ x[~free])
        value = 0.5 * x @ H @ x + g @ x
        if np.all(x >= lower - 1e-12) and np.all(x <= upper + 1e-12) and value < best:
            best, at = value, x
    return at


def test_quadratic_programs_agree_with_all_combinations_of_bounds():
    rng = np.random.default_rng(11)
    at_bounds = 0
    for n in (1, 2, 4, 5) * 5:
        H = rng.standard_normal((n, n))
        H, g = H @ H.T + 0.1 * np.eye(n), 3 * rng.standard_normal(n)
        lower, upper = -rng.uniform(0, 1, n), rng.uniform(0, 1, n)
        exact = enumerated(H, g, lower, upper)
        box, rows = oc.box_qp(H, g, lower, upper), oc.solve_qp(H, g, np.eye(n), lower, upper)
        assert box.converged and rows.converged
        np.testing.assert_allclose(box.x, exact, atol=1e-8)
        np.testing.assert_allclose(rows.x, exact, atol=1e-6)
        np.testing.assert_allclose(H @ box.x + g + box.multipliers, 0, atol=1e-7)
        np.testing.assert_allclose(H @ rows.x + g + rows.multipliers, 0, atol=1e-5)
        at_bounds += int(np.sum(~box.free))
    assert at_bounds > 20


def test_rows_of_quadratic_programs():
    # The point of a simplex nearest to a point outside: x >= 0, sum x = 1.
    result = oc.solve_qp(np.eye(3), [-2, -0.5, 0.3], np.vstack([np.eye(3), np.ones(3)]), [0, 0, 0, 1], [np.inf, np.inf, np.inf, 1])
    assert result.converged
    np.testing.assert_allclose(result.x, [1, 0, 0], atol=1e-7)
    again = oc.solve_qp(np.eye(3), [-2, -0.5, 0.3], np.vstack([np.eye(3), np.ones(3)]), [0, 0, 0, 1], [np.inf, np.inf, np.inf, 1], start=result)
    assert again.converged and again.iterations <= result.iterations
    contradiction = oc.solve_qp(np.eye(1), [0], [[1], [1]], [1, -np.inf], [np.inf, 0], iterations=200)
    assert not contradiction.converged and contradiction.residual > 0.1
    with pytest.raises(ValueError, match="lower exceeds upper"):
        oc.solve_qp(np.eye(1), [0], [[1]], [1], [0])
    with pytest.raises(ValueError, match="H is not positive definite"):
        oc.box_qp(-np.eye(2), [1, 1], [-1, -1], [1, 1])


def test_starts_of_quadratic_programs_do_not_change_the_minimum():
    narrow = oc.solve_qp([[1]], [-2], [[1]], [-9], [1])
    assert narrow.converged and narrow.x == pytest.approx([1], abs=1e-12) and narrow.multipliers == pytest.approx([1], abs=1e-12)
    wider = oc.solve_qp([[1]], [-2], [[1]], [-9], [1.5], start=narrow)
    assert wider.converged and wider.x == pytest.approx([1.5], abs=1e-12) and wider.multipliers == pytest.approx([0.5], abs=1e-12)
    free = oc.solve_qp([[1]], [-2], [[1]], [-np.inf], [np.inf], start=narrow)
    assert free.converged and free.x == pytest.approx([2], abs=1e-7) and free.multipliers == [0]


def test_quadratic_programs_with_a_minimum_of_zero_converge():
    result = oc.solve_qp([[2, 0.5], [0.5, 1]], [1, 1.3], [[1, 0.3], [0.2, 1]], [0, 0], [np.inf, np.inf])
    assert result.converged and not np.any(result.free)
    np.testing.assert_allclose(result.x, 0, atol=1e-15)
    rng = np.random.default_rng(5)
    for n in (3, 10, 30):
        H, A = rng.standard_normal((n, n)), np.eye(n) + 0.3 * rng.standard_normal((n, n)) / np.sqrt(n)
        H = H @ H.T + 0.1 * np.eye(n)
        result = oc.solve_qp(H, A.T @ rng.uniform(1, 2, n), A, np.zeros(n), np.full(n, np.inf))
        assert result.converged
        np.testing.assert_allclose(result.x, 0, atol=1e-13)


@pytest.mark.parametrize("call, message", [
    (lambda start: oc.box_qp([[1, 0.5], [0, 1]], [1, 1], [0, 0], [1, 1]), "H is not symmetric"),
    (lambda start: oc.box_qp(np.diag([1, np.inf]), [1, 1], [0, 0], [1, 1]), "H has infinite numbers"),
    (lambda start: oc.box_qp(np.eye(2), [1, 1], [0, 0], [1, 1], start=[0]), r"start has shape \(1,\), expected \(2,\)"),
    (lambda start: oc.box_qp(np.eye(2), [1, 1], [0, 0], [1, 1], start=[0, np.nan]), "start has numbers that are nan"),
    (lambda start: oc.solve_qp([[1, 0.5], [0, 1]], [1, 1], np.eye(2), [0, 0], [1, 1]), "P is not symmetric"),
    (lambda start: oc.solve_qp(np.diag([1, -1]), [1, 1], np.eye(2), [0, 0], [1, 1]), "P has a negative eigenvalue"),
    (lambda start: oc.solve_qp(np.eye(2), [1, np.inf], np.eye(2), [0, 0], [1, 1]), "q has infinite numbers"),
    (lambda start: oc.solve_qp(np.eye(2), [1, 1], 1, [0], [1]), r"A has shape \(\), expected \(1, 2\)"),
    (lambda start: oc.solve_qp(np.eye(2), [1, 1], np.eye(2), [0, 0], [1, 1], start=start), r"start.x has shape \(1,\), expected \(2,\)"),
    (lambda start: oc.solve_qp([[1]], [1], [[1], [1]], [0, 0], [1, 1], start=start),
     r"start.multipliers has shape \(1,\), expected \(2,\)"),
])
def test_wrong_quadratic_programs_are_named(call, message):
    start = oc.solve_qp([[1]], [-2], [[1]], [-9], [1])
    with pytest.raises(ValueError, match=message):
        call(start)


def test_rows_satisfy_the_conditions_of_a_minimum():
    rng = np.random.default_rng(8)
    held = 0
    for _ in range(8):
        H = rng.standard_normal((20, 20))
        H, g, A = H @ H.T + 1e-2 * np.eye(20), 10 * rng.standard_normal(20), rng.standard_normal((50, 20))
        lower, upper = -rng.uniform(0, 1, 50), rng.uniform(0, 1, 50)
        result = oc.solve_qp(H, g, A, lower, upper)
        value, y = A @ result.x, result.multipliers
        assert result.converged and np.all(value > lower - 1e-6) and np.all(value < upper + 1e-6)
        np.testing.assert_allclose(H @ result.x + g + A.T @ y, 0, atol=1e-5)
        size = 1e-6 * np.abs(y).max()
        np.testing.assert_allclose(value[y > size], upper[y > size], atol=1e-6)
        np.testing.assert_allclose(value[y < -size], lower[y < -size], atol=1e-6)
        held += int(np.sum(np.abs(y) > size))
    assert held > 80


# ---- Trajectories ----


def hinge_problem(hinge, steps=15):
    cost = oc.TrackingCost(hinge, np.diag([2.0, 0.1]), [[0.05]], np.diag([50.0, 20]), reference=[0.7, 0])
    return cost, np.array([-0.4, 0.3]), np.zeros((steps, 1))


def test_linear_problems_without_limits_have_the_solution_of_riccati(hinge):
    cost, x0, us = hinge_problem(hinge)
    plan = oc.ddp(hinge, cost, x0, us, lower=[-np.inf], upper=[np.inf])
    assert plan.converged and plan.iterations <= 2
    _, A, B = hinge.derivatives(x0, us[0])
    np.testing.assert_allclose(A, [[1, 0.1], [0, 1]], atol=1e-13)
    np.testing.assert_allclose(B, [[0.01], [0.2]], atol=1e-13)  # 1 / (0.5 kg m^2)
    P, gains = cost.Q_final, []
    for _ in us:
        K = np.linalg.solve(cost.R + B.T @ P @ B, B.T @ P @ A)
        P = A.T @ P @ (A - B @ K) + cost.Q
        gains.insert(0, K)
    np.testing.assert_allclose(plan.K, -np.array(gains), atol=1e-10)
    np.testing.assert_allclose(plan.us[0], -gains[0] @ (x0 - [0.7, 0]), atol=1e-10)
    np.testing.assert_allclose(plan.cost, 0.5 * (x0 - [0.7, 0]) @ P @ (x0 - [0.7, 0]), rtol=1e-11)


def test_limits_agree_with_the_quadratic_program(hinge):
    cost, x0, us = hinge_problem(hinge)
    assert np.array_equal(hinge.upper, [3])
    plan = oc.ddp(hinge, cost, x0, us, lower=[-1], upper=[1], tolerance=1e-14)
    P, q, G = oc.condense(hinge, cost, hinge.rollout(x0, us), us)
    exact = oc.box_qp(P, q, -np.ones(us.size), np.ones(us.size))
    assert plan.converged and exact.converged and 2 < np.sum(~exact.free) < us.size
    np.testing.assert_allclose(plan.us.ravel(), exact.x, atol=1e-6)
    np.testing.assert_allclose(plan.xs, hinge.rollout(x0, us) + (G @ exact.x), atol=1e-6)
    assert plan.us.min() >= -1 and plan.us.max() == 1 and np.all(np.diff(plan.costs) <= 0)


def base_problem():
    """A servicer that turns its base by its arms' joints, within small limits."""
    dynamics = dual_arm(step=0.2, inputs=["base_torque", *JOINTS[:3]])
    x0 = dynamics.plus(dynamics.state(*dynamics.robot.zero_state()), np.linspace(-0.3, 0.4, dynamics.ndx))
    goal = dynamics.state(*dynamics.robot.zero_state())
    weights = np.linspace(0.5, 2, dynamics.ndx)
    return dynamics, oc.TrackingCost(dynamics, np.diag(weights), 0.01 * np.eye(dynamics.nu), 10 * np.diag(weights), goal), x0


def test_gains_are_those_of_the_result(hinge):
    cost, x0, us = hinge_problem(hinge)
    once = oc.ddp(hinge, cost, x0, us, lower=[-np.inf], upper=[np.inf], iterations=1)  # which is enough for a linear problem
    assert once.status == "converged" and once.iterations == 1 and abs(once.gradient) < 1e-12
    dynamics, cost, x0 = base_problem()
    few = oc.ddp(dynamics, cost, x0, np.zeros((6, dynamics.nu)), iterations=1)
    assert few.status == "iterations" and few.gradient > 1e-9
    again = oc.ddp(dynamics, cost, x0, few.us, tolerance=2 * few.gradient)  # ends at its guess
    assert again.status == "converged" and np.array_equal(again.us, few.us)
    np.testing.assert_allclose(few.K, again.K, atol=1e-9 * np.abs(again.K).max())
    assert few.gradient == pytest.approx(again.gradient, rel=1e-6)


def test_searches_shorten_steps_that_the_dynamics_does_not_accept():
    # Torques cost almost nothing: the first trajectory of the search turns the base by 3.1 rad in one step.
    dynamics = dual_arm(step=1.0, inputs=["base_torque"], locked=JOINTS)
    x0 = dynamics.state(*dynamics.robot.zero_state())
    turn = np.zeros(dynamics.ndx)
    turn[2] = 3.1
    Q = np.zeros((dynamics.ndx, dynamics.ndx))
    Q[:3, :3] = np.eye(3)
    cost = oc.TrackingCost(dynamics, Q, 1e-12 * np.eye(3), Q, dynamics.plus(x0, turn))
    limit = np.full(3, np.inf)
    refused = []

    class Watched(oc.DiscreteDynamics):
        def __call__(self, x, u):
            try:
                return super().__call__(x, u)
            except ValueError:
                refused.append(np.ndim(x))
                raise
    watched = Watched(dynamics.robot, step=1.0, inputs=["base_torque"], locked=JOINTS)
    plan = oc.ddp(watched, cost, x0, np.zeros((4, 3)), lower=-limit, upper=limit)
    assert 2 in refused and 1 in refused
    assert plan.cost < 0.9 * plan.costs[0] and np.all(np.diff(plan.costs) <= 0)
    np.testing.assert_allclose(dynamics.rollout(x0, plan.us), plan.xs, atol=1e-9)
    with pytest.raises(ValueError, match="choose more substeps"):
        oc.ddp(dynamics, cost, x0, np.full((4, 3), 1e9), lower=-limit, upper=limit)


def test_gradients_of_shooting_agree_with_differences():
    dynamics, cost, x0 = base_problem()
    problem = oc.ShootingProblem(dynamics, cost, x0, 3)
    u = np.random.default_rng(2).uniform(-1, 1, 3 * dynamics.nu)
    value, gradient = problem.value_and_gradient(u)
    directions = np.random.default_rng(4).uniform(-1, 1, (4, u.size))
    by_differences = differences(lambda d: np.array([problem.value_and_gradient(u + one @ directions)[0] for one in d]), 4, 0.1)
    assert value > 1 and np.abs(gradient).max() > 1e-2
    np.testing.assert_allclose(directions @ gradient, by_differences, atol=1e-7 * np.abs(gradient).max())  # measured 2e-9
    assert problem.trajectory(u).shape == (4, dynamics.nx)


def test_plans_of_a_free_base_satisfy_the_conditions_of_a_minimum():
    dynamics, cost, x0 = base_problem()
    limit = np.full(dynamics.nu, 3.0)
    plan = oc.ddp(dynamics, cost, x0, np.zeros((6, dynamics.nu)), lower=-limit, upper=limit, iterations=60, tolerance=1e-12)
    assert plan.converged and plan.costs[-1] < 0.97 * plan.costs[0]
    np.testing.assert_allclose(dynamics.rollout(x0, plan.us), plan.xs, atol=1e-12)
    _, gradient = oc.ShootingProblem(dynamics, cost, x0, 6).value_and_gradient(plan.us)
    gradient, size = gradient.reshape(plan.us.shape), np.abs(gradient).max()
    at_upper, at_lower = plan.us >= limit, plan.us <= -limit
    assert 0 < np.sum(at_upper | at_lower) < plan.us.size
    assert np.abs(gradient[~at_upper & ~at_lower]).max() < 1e-4 * size
    assert np.all(gradient[at_upper] < 0) and np.all(gradient[at_lower] > 0)


def test_action_models_have_the_derivatives_of_crocoddyl():
    dynamics, cost, x0 = base_problem()
    model = oc.ActionModel(dynamics, cost)
    data, u = model.createData(), np.linspace(-1, 1, dynamics.nu)
    model.calc(data, x0, u)
    running = data.cost
    assert np.array_equal(data.xnext, dynamics(x0, u))
    model.calcDiff(data, x0, u)

    def value(dx, du):
        model.calc(data, dynamics.plus(x0, dx), u + du)
        return data.cost
    directions = np.random.default_rng(4).uniform(-1, 1, (4, dynamics.ndx))
    by_state = differences(lambda d: np.array([value(one @ directions, 0) for one in d]), 4, 1e-2)
    by_input = differences(lambda du: np.array([value(np.zeros(dynamics.ndx), one) for one in du]), dynamics.nu, 1e-2)
    np.testing.assert_allclose(directions @ data.Lx, by_state, atol=1e-7)
    np.testing.assert_allclose(data.Lu, by_input, atol=1e-7)
    assert data.Fx.shape == (dynamics.ndx, dynamics.ndx) and data.Fu.shape == (dynamics.ndx, dynamics.nu) == data.Lxu.shape
    model.calc(data, x0)
    assert data.cost > running  # ten times the weights
    model.calcDiff(data, x0)
    np.testing.assert_allclose(data.Lx, differences(lambda dx: cost.value(dynamics.plus(x0, dx)[:, None], np.zeros((1, 0, dynamics.nu))),
                                                    dynamics.ndx, 1e-2), atol=1e-6)


def test_wrong_plans_are_named(hinge):
    cost, x0, us = hinge_problem(hinge)
    with pytest.raises(ValueError, match=r"us has shape \(15, 2\), expected \(steps, 1\)"):
        oc.ddp(hinge, cost, x0, np.zeros((15, 2)))
    with pytest.raises(ValueError, match=r"Q has shape \(3, 3\), expected \(2, 2\)"):
        oc.TrackingCost(hinge, np.eye(3), [[1]], np.eye(2), x0)
    with pytest.raises(ValueError, match="lower exceeds upper"):
        oc.ddp(hinge, cost, x0, us, lower=[1], upper=[0])
    with pytest.raises(ValueError, match="Q_final is not symmetric"):
        oc.TrackingCost(hinge, np.eye(2), [[1]], [[1, 1], [0, 1]], x0)
    with pytest.raises(ValueError, match="R has infinite numbers"):
        oc.TrackingCost(hinge, np.eye(2), [[np.inf]], np.eye(2), x0)
    with pytest.raises(ValueError, match=r"reference has shape \(3,\), expected \(2,\) or \(steps \+ 1, 2\)"):
        oc.TrackingCost(hinge, np.eye(2), [[1]], np.eye(2), [0, 0, 0])
    with pytest.raises(ValueError, match=r"reference_input has shape \(2,\), expected \(1,\) or \(steps, 1\)"):
        oc.TrackingCost(hinge, np.eye(2), [[1]], np.eye(2), x0, reference_input=[0, 0])
