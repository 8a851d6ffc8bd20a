"""Functions on robots, compared with finite differences, identities and each other; shapes and messages."""

import pickle
import threading

import numpy as np
import pytest
from conftest import SOURCE, SPATIAL, THESIS

import grapnel


@pytest.fixture(scope="module")
def robot():
    return grapnel.Robot(SPATIAL)


@pytest.fixture(scope="module")
def system():
    """The thesis's servicer with its two free targets."""
    return grapnel.Robot(grapnel.load(THESIS), targets=True)


def states(robot, n, seed=1):
    """Random states: poses, joint values and velocities."""
    random = np.random.default_rng(seed)
    q, v = random.uniform(-1, 1, (n, robot.nq)), random.uniform(-1, 1, (n, robot.nv))
    for body in robot.bodies:
        at = robot.body_q(body)
        if at is not None:
            quaternion = q[:, at][:, 3:]
            quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return q, v


def moved(robot, q, v, h):
    """q after a time h at constant velocities (of one state), by the definition of q and v."""
    q = q.copy()
    for j, at in zip(robot.joint_v, robot.joint_q):
        q[at] += h * v[j]
    for body in robot.bodies:
        if robot.body_q(body) is None:
            continue
        x, u = q[robot.body_q(body)], v[robot.body_v(body)]
        R = robot.frame_pose(body, q)[:3, :3]
        w, a, b, c = x[3:]
        rate = 0.5 * np.array([-a * u[0] - b * u[1] - c * u[2], w * u[0] + b * u[2] - c * u[1],
                               w * u[1] + c * u[0] - a * u[2], w * u[2] + a * u[1] - b * u[0]])
        x[3:] += h * rate
        x[3:] /= np.linalg.norm(x[3:])
        x[:3] += h * R @ u[3:]
    return q


def test_names_and_sizes(robot):
    assert robot.nq == 7 + robot.nu and robot.nv == 6 + robot.nu and robot.nu == len(robot.joints) == 14
    assert len(robot.q_names) == robot.nq and len(robot.v_names) == robot.nv
    assert robot.q_names[3] == f"{robot.base}/qw" and robot.v_names[0] == f"{robot.base}/wx"
    assert [robot.q_names[i] for i in robot.joint_q] == robot.joints == [robot.v_names[i] for i in robot.joint_v]
    assert robot.lower.shape == robot.upper.shape == robot.effort_limit.shape == (14,)
    assert robot.mass > 0 and robot.base in robot.bodies


def test_names_of_a_problem_with_targets(system):
    assert system.bodies[-2:] == ["target:target-1", "target:target-2"]
    assert system.nq == 7 + 6 + 2 * 7 and system.nu == 6
    q, v = system.initial_state()
    assert np.allclose(q[system.joint_q], [0.698, -1.571, 1.047, 2.444, 1.571, -1.047])
    # Targets rotate freely to the state that the file specifies at the capture.
    assert np.allclose(v[system.body_v("target:target-1")], [0, 0, 0.2, 0, 0, 0], atol=1e-15)
    assert np.allclose(q[system.body_q("target:target-2")][:3], [-2, 2, 0], atol=1e-12)


@pytest.mark.parametrize("which", ["robot", "system"])
def test_twists_and_jacobians_are_derivatives_of_poses(which, request):
    robot = request.getfixturevalue(which)
    q, v = (x[0] for x in states(robot, 1))
    h = 1e-5
    for frame in robot.frames:
        X0, X1 = (robot.frame_pose(frame, moved(robot, q, v, s)) for s in (-h, h))
        V = robot.frame_twist(frame, q, v)
        assert np.allclose((X1[:3, 3] - X0[:3, 3]) / (2 * h), V[3:], atol=1e-8)
        R = robot.frame_pose(frame, q)[:3, :3]
        W = (X1[:3, :3] - X0[:3, :3]) / (2 * h) @ R.T
        assert np.allclose([W[2, 1], W[0, 2], W[1, 0]], V[:3], atol=1e-8)
        assert np.allclose(robot.jacobian(frame, q) @ v, V, atol=1e-13)
        assert np.linalg.norm(V) > 0.1


def test_mass_matrix_bias_and_dynamics_agree(robot):
    q, v = states(robot, 5)
    tau = np.random.default_rng(3).uniform(-5, 5, (5, robot.nv))
    gravity = [0.3, -0.2, -1.0]
    M, c = robot.mass_matrix(q), robot.bias(q, v, gravity=gravity)
    vdot = robot.forward_dynamics(q, v, tau, gravity=gravity)
    assert np.allclose(np.einsum("nij,nj->ni", M, vdot) + c, tau, atol=1e-10)
    assert np.allclose(robot.inverse_dynamics(q, v, vdot, gravity=gravity), tau, atol=1e-10)
    assert np.allclose(robot.inverse_dynamics(q, v, 0 * v, gravity=gravity), c, atol=1e-12)
    assert np.allclose(M, np.swapaxes(M, 1, 2)) and np.all(np.linalg.eigvalsh(M) > 0)
    assert np.allclose(robot.kinetic_energy(q, v), 0.5 * np.einsum("ni,nij,nj->n", v, M, v), rtol=1e-12)
    # An effort per joint equals generalized forces with zero force on the base.
    joints = np.zeros_like(tau)
    joints[:, robot.joint_v] = tau[:, robot.joint_v]
    assert np.array_equal(robot.forward_dynamics(q, v, tau[:, robot.joint_v]), robot.forward_dynamics(q, v, joints))


def test_derivatives_agree_with_differences(robot):
    n, h, gravity = 3, 1e-4, [0.3, -0.2, -1.0]
    q, v = states(robot, n)
    rng = np.random.default_rng(5)
    tau, vdot = rng.uniform(-5, 5, (n, robot.nv)), rng.uniform(-2, 2, (n, robot.nv))
    forward = robot.forward_dynamics_derivatives(q, v, tau, gravity=gravity)
    inverse = robot.inverse_dynamics_derivatives(q, v, vdot, gravity=gravity)
    assert forward.dwrench.shape == (n, robot.nv, 0)
    assert np.allclose(forward.vdot, robot.forward_dynamics(q, v, tau, gravity=gravity), atol=1e-10)
    assert np.allclose(inverse.tau, robot.inverse_dynamics(q, v, vdot, gravity=gravity), atol=1e-10)
    assert np.allclose(inverse.dvdot, robot.mass_matrix(q), atol=1e-10)
    assert np.allclose(forward.dtau @ inverse.dvdot, np.eye(robot.nv), atol=1e-9)

    def check(derivative, of):
        columns = np.stack([(of(h * e) - of(-h * e)) / (2 * h) for e in np.eye(robot.nv)], axis=-1)
        assert np.max(np.abs(derivative)) > 1e-2
        assert np.allclose(derivative, columns, atol=1e-5 * np.max(np.abs(columns)))  # the error of the differences: h^2

    for i in range(n):
        def at(x, i=i):
            return moved(robot, q[i], x, 1.0)
        check(forward.dq[i], lambda x: robot.forward_dynamics(at(x), v[i], tau[i], gravity=gravity))
        check(forward.dv[i], lambda x: robot.forward_dynamics(q[i], v[i] + x, tau[i], gravity=gravity))
        check(forward.dtau[i], lambda x: robot.forward_dynamics(q[i], v[i], tau[i] + x, gravity=gravity))
        check(inverse.dq[i], lambda x: robot.inverse_dynamics(at(x), v[i], vdot[i], gravity=gravity))
        check(inverse.dv[i], lambda x: robot.inverse_dynamics(q[i], v[i] + x, vdot[i], gravity=gravity))


def test_derivatives_with_wrenches_and_a_held_base(robot):
    q, v = (x[0] for x in states(robot, 1))
    frame = robot.frames[0]
    wrench = np.array([[0.3, -0.2, 0.1, 2.0, 1.0, -3.0]])
    J = robot.jacobian(frame, q)
    d = robot.forward_dynamics_derivatives(q, v, frames=[frame], wrenches=wrench)
    assert np.allclose(d.dwrench, d.dtau @ J.T, atol=1e-12)
    assert np.allclose(d.vdot, robot.forward_dynamics(q, v, J.T @ wrench[0]), atol=1e-10)
    plain = robot.forward_dynamics_derivatives(q, v, J.T @ wrench[0])
    assert not np.allclose(d.dq, plain.dq, atol=1e-3)  # a wrench keeps its direction in W, generalized forces do not
    held = robot.forward_dynamics_derivatives(q, v, base_held=True)
    joints = np.asarray(robot.joint_v)
    assert np.all(held.vdot[:6] == 0) and np.all(held.dq[:6] == 0)
    M = robot.mass_matrix(q)[np.ix_(joints, joints)]
    assert np.allclose(held.dtau[np.ix_(joints, joints)], np.linalg.inv(M), atol=1e-9)
    many = robot.forward_dynamics_derivatives(np.tile(q, (100, 1)), v, frames=[frame], wrenches=wrench)
    assert np.array_equal(many.dq[57], d.dq) and np.array_equal(many.dwrench[99], d.dwrench)
    with pytest.raises(ValueError, match=r"wrenches has shape \(1, 5\), expected \(1, 6\)"):
        robot.forward_dynamics_derivatives(q, v, frames=[frame], wrenches=wrench[:, :5])


def test_momentum_and_the_free_floating_quantities(robot):
    q, v = states(robot, 4)
    M = robot.mass_matrix(q)
    I_b, I_bm, I_m = M[:, :6, :6], M[:, :6, 6:], M[:, 6:, 6:]
    assert np.allclose(robot.base_inertia(q), I_b) and np.allclose(robot.coupling_inertia(q), I_bm)
    generalized = I_m - np.swapaxes(I_bm, 1, 2) @ np.linalg.solve(I_b, I_bm)
    assert np.allclose(robot.generalized_inertia(q), generalized, atol=1e-10)
    # Momentum in B at B's origin is the mass matrix's first rows times v.
    X = robot.frame_pose(robot.base, q)
    about_base = np.stack([robot.momentum(q[i], v[i], about=X[i, :3, 3]) for i in range(4)])
    in_base = np.concatenate([np.einsum("nji,nj->ni", X[:, :3, :3], about_base[:, k:k + 3]) for k in (0, 3)], axis=1)
    assert np.allclose(in_base, np.einsum("nij,nj->ni", M[:, :6], v), atol=1e-9)
    assert np.linalg.norm(in_base) > 1
    # Motion of the base at zero momentum for given joint rates, and the resulting motion of the tip.
    rates = v[:, 6:]
    twist = robot.base_twist(q, rates)
    still = np.concatenate([np.einsum("nji,nj->ni", X[:, :3, :3], twist[:, k:k + 3]) for k in (0, 3)] + [rates], axis=1)
    assert np.allclose(robot.momentum(q, still), 0, atol=1e-9)
    for frame in robot.frames:
        J_g = robot.generalized_jacobian(frame, q)
        assert np.allclose(np.einsum("nij,nj->ni", J_g, rates), robot.frame_twist(frame, q, still), atol=1e-11)
    h = robot.momentum(q, v)
    with_momentum = robot.base_twist(q, rates, h)
    assert np.allclose(with_momentum, robot.frame_twist(robot.base, q, v), atol=1e-11)


@pytest.mark.parametrize("n", [1, 7, 300])
def test_batches_are_their_rows(robot, n):
    q, v = states(robot, n)
    frame = robot.frames[0]
    tau = np.random.default_rng(5).uniform(-1, 1, (n, robot.nu))
    functions = {
        "frame_pose": lambda q, v, t: robot.frame_pose(frame, q), "frame_twist": lambda q, v, t: robot.frame_twist(frame, q, v),
        "jacobian": lambda q, v, t: robot.jacobian(frame, q), "mass_matrix": lambda q, v, t: robot.mass_matrix(q),
        "generalized_jacobian": lambda q, v, t: robot.generalized_jacobian(frame, q),
        "generalized_inertia": lambda q, v, t: robot.generalized_inertia(q),
        "momentum": lambda q, v, t: robot.momentum(q, v), "bias": lambda q, v, t: robot.bias(q, v),
        "center_of_mass": lambda q, v, t: robot.center_of_mass(q), "energy": lambda q, v, t: robot.kinetic_energy(q, v),
        "forward": lambda q, v, t: robot.forward_dynamics(q, v, t), "inverse": lambda q, v, t: robot.inverse_dynamics(q, v, v),
        "base_twist": lambda q, v, t: robot.base_twist(q, t),
    }
    for name, function in functions.items():
        batch = np.asarray(function(q, v, tau))
        for i in {0, n // 2, n - 1}:
            assert np.array_equal(batch[i], function(q[i], v[i], tau[i])), name
    # Single arguments apply to every row.
    assert np.array_equal(robot.frame_twist(frame, q[0], v)[n - 1], robot.frame_twist(frame, q[0], v[n - 1]))
    assert robot.mass_matrix(q[:0]).shape == (0, robot.nv, robot.nv)


def test_forward_kinematics_has_all_bodies_and_frames(robot):
    q, _ = states(robot, 2)
    poses = robot.forward_kinematics(q)
    assert {*robot.bodies, *robot.frames} == set(poses) and poses[robot.base].shape == (2, 4, 4)
    assert np.allclose(poses[robot.base][:, :3, 3], q[:, :3]) and np.allclose(poses[robot.base][:, 3], [0, 0, 0, 1])


@pytest.mark.parametrize("call, message", [
    (lambda r, q, v: r.mass_matrix(q[:-1]), r"q has shape \(20,\), expected \(21,\)"),
    (lambda r, q, v: r.mass_matrix(np.zeros((2, 3, 21))), r"q has shape \(2, 3, 21\)"),
    (lambda r, q, v: r.bias(q, v[None, :3]), r"v has shape \(1, 3\), expected \(20,\), or \(n, 20\)"),
    (lambda r, q, v: r.bias(np.tile(q, (2, 1)), np.tile(v, (3, 1))), r"q has shape \(2, 21\) and v has shape \(3, 20\)"),
    (lambda r, q, v: r.forward_dynamics(q, v, np.zeros(3)), r"tau has shape \(3,\)"),
    (lambda r, q, v: r.momentum(q, v, about=[1, 2]), r"about has shape \(2,\)"),
    (lambda r, q, v: r.bias(q, v, gravity=[0, 1]), r"gravity has shape \(2,\), expected \(3,\)"),
    (lambda r, q, v: r.bias(q, v * np.nan), r"v\[0\] is nan"),
    (lambda r, q, v: r.mass_matrix(np.where(np.arange(21) == 9, np.inf, q)), r"q\[9\] is inf"),
    (lambda r, q, v: r.mass_matrix(2 * q), r"q\[3:7\] is a quaternion of norm 2"),
    (lambda r, q, v: r.mass_matrix(np.stack([q, 0 * q])), r"q\[1, 3:7\] is a quaternion of norm 0"),
    (lambda r, q, v: r.jacobian("tipp-1", q), r"no frame or body is named 'tipp-1'"),
    (lambda r, q, v: r.mass_matrix([[1, 2], [3]]), "q"),
    (lambda r, q, v: r.body_q("nothing"), "no body is named 'nothing'"),
    (lambda r, q, v: r.impact(q, v, []), "there are no grasps"),
    (lambda r, q, v: r.impact(q, v, ["tip-1"]), "is not a pair"),
    (lambda r, q, v: r.impact(q, v, [(r.frames[0], r.base, "glue")]), "kind is 'glue'"),
    (lambda r, q, v: r.loops([]), "there are no closures"),
])
def test_wrong_arguments_are_named(robot, call, message):
    q, v = robot.zero_state()
    with pytest.raises(ValueError, match=message):
        call(robot, q, v)


@pytest.mark.parametrize("wrong", ["text", None, {"a": 1}, object(), np.array(["a"]), 1j * np.ones(21)])
def test_arguments_that_are_not_numbers_are_rejected(robot, wrong):
    with pytest.raises((TypeError, ValueError)):
        robot.mass_matrix(wrong)


def test_derivatives_with_closed_loops(robot):
    (q, v), h, gravity = (x[0] for x in states(robot, 1)), 1e-4, [0.3, -0.2, -1.0]
    a, b = robot.frames[:2]
    loops = robot.loops([(a, b)], closed_at=q)
    v = loops.close_velocities(q, v)
    tau = np.random.default_rng(8).uniform(-5, 5, robot.nv)
    d = loops.forward_dynamics_derivatives(q, v, tau, gravity=gravity)
    vdot, multipliers = loops.forward_dynamics(q, v, tau, gravity=gravity)
    assert np.allclose(d.vdot, vdot, atol=1e-9 * np.max(np.abs(vdot)))
    assert d.contradiction < 1e-8 and d.rank <= loops.rows and d.dwrench.shape == (robot.nv, 0)

    def check(derivative, of):
        columns = np.stack([(of(h * e) - of(-h * e)) / (2 * h) for e in np.eye(robot.nv)], axis=-1)
        assert np.max(np.abs(derivative)) > 1e-3
        assert np.allclose(derivative, columns, atol=1e-5 * np.max(np.abs(columns)))

    check(d.dq, lambda x: loops.forward_dynamics(moved(robot, q, x, 1.0), v, tau, gravity=gravity)[0])
    check(d.dv, lambda x: loops.forward_dynamics(q, v + x, tau, gravity=gravity)[0])
    check(d.dtau, lambda x: loops.forward_dynamics(q, v, tau + x, gravity=gravity)[0])
    check(d.closing_dq, lambda x: loops.close_velocities(moved(robot, q, x, 1.0), v))
    if d.rank == loops.rows:
        check(d.multipliers_dq, lambda x: loops.forward_dynamics(moved(robot, q, x, 1.0), v, tau, gravity=gravity)[1])
        assert np.allclose(d.multipliers, multipliers, atol=1e-8 * np.max(np.abs(multipliers)))
    held = loops.forward_dynamics_derivatives(q, v, tau, base_held=True)
    assert np.all(held.dq[:6] == 0) and np.max(np.abs(held.dq)) > 1e-3
    many = loops.forward_dynamics_derivatives(np.tile(q, (50, 1)), np.tile(v, (50, 1)), tau, gravity=gravity)
    assert np.array_equal(many.dq[31], d.dq) and many.rank.shape == (50,) and many.multipliers_dv.shape[0] == 50


def test_closed_loops(robot):
    q, v = (x[0] for x in states(robot, 1, seed=4))
    a, b = robot.frames[:2]
    loops = robot.loops([(a, b)], closed_at=q)
    assert loops.rows == 6 and loops.defect(q).shape == (1, 4)
    assert np.all(loops.defect(q)[:, :2] < 1e-14) and loops.defect(q, v)[0, 2] > 0.1
    closed = loops.close_velocities(q, v)
    assert np.all(loops.defect(q, closed) < 1e-12)
    # It conserves momentum and does not increase the energy.
    assert np.allclose(robot.momentum(q, closed), robot.momentum(q, v), atol=1e-10)
    assert robot.kinetic_energy(q, closed) < robot.kinetic_energy(q, v)
    # Accelerations that keep the loop closed equal differences of the closing velocity along the motion.
    tau = np.random.default_rng(1).uniform(-5, 5, robot.nu)
    vdot, multipliers = loops.forward_dynamics(q, closed, tau)
    assert multipliers.shape == (6,) and np.linalg.norm(multipliers) > 1e-3
    h = 1e-5
    ahead = loops.defect(moved(robot, q, closed + 0.5 * h * vdot, h), closed + h * vdot)
    assert np.all(ahead[:, 2:] < 1e-8)  # about 1e-5 without the multipliers
    off = q.copy()
    off[robot.joint_q[0]] += 1e-3
    assert loops.defect(off)[0, 0] > 1e-5
    projected, _, converged = loops.project(off, closed)
    assert converged == 1 and np.all(loops.defect(projected)[:, :2] < 1e-12)
    batch = loops.forward_dynamics(np.tile(q, (100, 1)), np.tile(closed, (100, 1)), tau)
    assert np.array_equal(batch[0][57], vdot) and np.array_equal(batch[1][57], multipliers)


def test_impacts(system):
    q, v = system.initial_state()
    v = v + 0.1 * np.random.default_rng(2).standard_normal(system.nv)
    grasps = [("tip-1", "target:target-1"), ("tip-2", "target:target-2", "hinge", [0, 0, 1])]
    impact = system.impact(q, v, grasps)
    M = system.mass_matrix(q)
    # M (v+ - v-) = J^T P with the Jacobians of end-effectors and targets at the contact points.
    J = []
    for (end_effector, target, *_), point in zip(grasps, impact.contact_point):
        X = system.frame_pose(target, q)
        J_t = system.jacobian(target, q)
        arm = point - X[:3, 3]
        cross = np.array([[0, -arm[2], arm[1]], [arm[2], 0, -arm[0]], [-arm[1], arm[0], 0]])
        J_t = np.concatenate([J_t[:3], J_t[3:] - cross @ J_t[:3]])
        J.append(system.jacobian(end_effector, q) - J_t)
    generalized = sum(j.T @ P for j, P in zip(J, impact.impulse))
    assert np.allclose(M @ (impact.velocity - v), generalized, atol=1e-10)
    assert np.allclose(J[0] @ impact.velocity, 0, atol=1e-12)
    assert np.allclose((J[1] @ impact.velocity)[[0, 1, 3, 4, 5]], 0, atol=1e-12)
    assert abs((J[1] @ impact.velocity)[2]) > 1e-3  # the hinge rotates
    assert np.allclose(system.momentum(q, impact.velocity), system.momentum(q, v), atol=1e-10)
    assert impact.rank == 11 and impact.kinetic_energy_after < impact.kinetic_energy_before
    assert np.allclose(impact.kinetic_energy_before, system.kinetic_energy(q, v))
    assert impact.generalized_momentum_residual < 1e-12
    braked = system.impact(q, v, grasps, joints="braked")
    assert np.allclose(braked.velocity[system.joint_v], 0, atol=1e-12)
    batch = system.impact(np.tile(q, (3, 1)), v, grasps)
    assert batch.impulse.shape == (3, 2, 6) and np.array_equal(batch.velocity[2], impact.velocity)


def test_other_threads_run_during_a_computation(robot):
    q, v = states(robot, 20_000)
    ticks, done = [], threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(len(ticks))
            done.wait(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    before = len(ticks)
    robot.mass_matrix(q)
    after = len(ticks)
    done.set()
    thread.join()
    assert after > before


def test_robots_from_model_files_and_ready_made_robots():
    arm = grapnel.Robot(SOURCE / "examples/python/arm_on_satellite.urdf")
    assert {"shoulder", "elbow", "wrist_yaw"} <= set(arm.joints) and arm.mass > 0
    assert grapnel.Robot("ets-vii").nu == 6
    with pytest.raises(grapnel.InputError, match="did you mean 'ets-vii'"):
        grapnel.Robot("ets-vi")


@pytest.mark.parametrize("nothing", [None, 3, {}, ["a"]])
def test_wrong_sources_of_a_robot(nothing):
    with pytest.raises(TypeError, match="expected a path"):
        grapnel.Robot(nothing)


def test_robots_can_be_sent_to_other_processes(robot, system):
    q, v = system.initial_state()
    problem = grapnel.load(THESIS)
    mine = grapnel.Robot(problem, targets=True)
    problem.targets[0].mass = 77  # robots are immutable
    again = pickle.loads(pickle.dumps(mine))
    assert again.mass == mine.mass == system.mass and np.array_equal(again.mass_matrix(q), system.mass_matrix(q))
    loops = pickle.loads(pickle.dumps(robot.loops([robot.frames[:2]], closed_at=robot.zero_state()[0])))
    assert loops.rows == 6 and np.all(loops.defect(robot.zero_state()[0]) < 1e-14)
    rollout = grapnel.Rollout(robot, 0.02, 3, "euler", [0, 0, -1], friction=False)
    x = rollout.state(*robot.zero_state())
    assert np.array_equal(rollout(x, steps=2), pickle.loads(pickle.dumps(rollout))(x, steps=2))


@pytest.mark.parametrize("lanes", ["sse2", "avx2", "off"])
def test_all_instruction_sets_agree(robot, lanes, monkeypatch):
    q, v = states(robot, 21)
    monkeypatch.setenv("GRAPNEL_LANES", lanes)
    try:
        other = grapnel.Robot(SPATIAL)
    except RuntimeError:
        pytest.skip(f"{lanes} is not supported on this machine")
    assert grapnel.instruction_set() == {"off": "one_lane"}.get(lanes, lanes)
    found, expected = other.forward_dynamics(q, v), robot.forward_dynamics(q, v)
    assert np.allclose(found, expected, rtol=1e-11) and (lanes == "sse2" or np.array_equal(found, expected))
    for i in (0, 20):
        assert np.array_equal(other.forward_dynamics(q[i], v[i]), found[i])
    monkeypatch.setenv("GRAPNEL_LANES", "avx1024")
    with pytest.raises(RuntimeError, match="GRAPNEL_LANES is 'avx1024'"):
        grapnel.Robot(SPATIAL)


def test_rows_are_the_bits_of_single_states(robot):
    """Rows of batches, of odd sizes too, and single arguments."""
    q, v = states(robot, 67)
    tau = np.random.default_rng(9).uniform(-1, 1, (67, robot.nv))
    assert np.array_equal(robot.forward_dynamics(q, v, tau)[3:70], np.concatenate(
        [robot.forward_dynamics(q[3:], v[3:], tau[3:])]))
    assert np.array_equal(robot.forward_dynamics(q[0], v[0], tau)[66], robot.forward_dynamics(q[0], v[0], tau[66]))
    assert np.array_equal(robot.inverse_dynamics(q, v, tau[0])[66], robot.inverse_dynamics(q[66], v[66], tau[0]))
    assert np.array_equal(robot.bias(q[0], v)[66], robot.bias(q[0], v[66]))


def test_rounding_errors_of_quaternion_norms_are_removed(robot):
    q, v = (x[0] for x in states(robot, 1))
    off = q.copy()
    off[3:7] *= 1 + 1e-9
    assert np.allclose(robot.frame_pose(robot.frames[0], off), robot.frame_pose(robot.frames[0], q), atol=1e-14)
    assert np.allclose(robot.mass_matrix(off), robot.mass_matrix(q), rtol=1e-14)


def test_a_prismatic_joint_on_a_fixed_base(tmp_path):
    text = (SOURCE / "robots/planar-test-bed.yaml").read_text(encoding="utf-8")
    changed = text.replace("name: joint-2, type: continuous, axis: [0, 0, 1]", "name: joint-2, type: prismatic, axis: [0, 1, 0]")
    changed = changed.replace("  name: base\n", "  name: base\n  mode: fixed\n", 1)
    assert changed.count("prismatic") == text.count("prismatic") + 1 and "mode: fixed" in changed
    (tmp_path / "robot.yaml").write_text(changed, encoding="utf-8")
    robot = grapnel.Robot(tmp_path / "robot.yaml")
    assert (robot.nq, robot.nv, robot.nu) == (2, 2, 2)
    q, v = states(robot, 6)
    tau = np.random.default_rng(4).uniform(-1, 1, (6, robot.nv))
    M, c = robot.mass_matrix(q), robot.bias(q, v)
    vdot = robot.forward_dynamics(q, v, tau)
    assert np.allclose(np.einsum("nij,nj->ni", M, vdot) + c, tau, atol=1e-10)
    assert np.allclose(robot.inverse_dynamics(q, v, vdot), tau, atol=1e-10)
    assert robot.base_inertia(q).shape == (6, 0, 0) and robot.coupling_inertia(q).shape == (6, 0, 2)
    assert np.allclose(robot.generalized_inertia(q), M)
    frame = robot.frames[0]
    assert np.allclose(robot.generalized_jacobian(frame, q), robot.jacobian(frame, q))
    with pytest.raises(ValueError, match="fixed to the world"):
        robot.base_twist(q, v)
