"""Identification of a held body: exact if the motion determines all parameters, otherwise without values."""

import pickle

import numpy as np
import pytest
from conftest import SOURCE

import grapnel
from grapnel.identify import PARAMETERS

SCENARIO = SOURCE / "scenarios" / "heavy-satellite-detumble.yaml"


@pytest.fixture(scope="module")
def problem():
    return grapnel.load(SCENARIO)


@pytest.fixture(scope="module")
def held(problem):
    free = grapnel.Robot(problem, targets=True)
    q, _ = free.initial_state()
    return free.holding(q)


@pytest.fixture(scope="module")
def frame(problem):
    return f"target:{problem.targets[0].name}"


def motion(robot, n, seed=3):
    """Samples with zero momentum: random joint values and rates, and the resulting motion of the base."""
    random = np.random.default_rng(seed)
    q, v = (np.tile(x, (n, 1)) for x in robot.zero_state())
    q[:, robot.joint_q] = random.uniform(-1, 1, (n, robot.nu))
    rates = random.uniform(-0.1, 0.1, (n, robot.nu))
    v[:, robot.joint_v] = rates
    v[:, robot.body_v(robot.base)] = robot.base_twist(q, rates)  # unrotated: W's axes are the base's
    return q, v


def truth(problem):
    """The values of the scenario."""
    target = problem.targets[0]
    inertia = dict(target.inertia)
    return np.array([target.mass, *target.com, *(inertia.get(key, 0) for key in ("xx", "yy", "zz", "xy", "xz", "yz"))], dtype=float)


def test_the_target_is_attached_to_the_arm(problem, held, frame):
    free = grapnel.Robot(problem, targets=True)
    q, _ = free.initial_state()
    assert held.nq == free.nq - 7 and held.nu == free.nu
    assert held.mass == pytest.approx(free.mass, rel=1e-14)
    # In the pose at which the grasp closed.
    own = np.concatenate([q[free.body_q(free.base)], q[free.joint_q]])
    np.testing.assert_allclose(held.frame_pose(frame, own), free.frame_pose(frame, q), atol=1e-12)
    again = pickle.loads(pickle.dumps(held))
    np.testing.assert_array_equal(again.frame_pose(frame, own), held.frame_pose(frame, own))
    with pytest.raises(ValueError, match="does not begin with the targets that this robot holds"):
        held.initial_state()
    with pytest.raises(ValueError, match=r"expected Robot\(problem, targets=True\)"):
        held.holding(own)
    with pytest.raises(ValueError, match="no free targets"):
        grapnel.Robot(problem).holding(own)


@pytest.mark.parametrize("base", ["twist", "rotation"])
@pytest.mark.parametrize("known", [True, False])
def test_exact_rates_determine_all_parameters(problem, held, frame, base, known):
    q, v = motion(held, 30)
    assert np.abs(held.momentum(q, v)).max() < 1e-9 < np.abs(v).max()
    found = grapnel.identify(held, frame, q, v, base=base, momentum=np.zeros(6) if known else None)
    assert found.all_determined and found.converged and found.impossible == ""
    assert (found.mass, found.com, found.inertia) == ("determined",) * 3
    expected = truth(problem)
    scale = np.array([expected[0]] + [1.0] * 3 + [expected[4:7].max()] * 6)
    error = np.abs(found.value - expected) / scale
    assert error.max() < 1e-10  # measured 3e-15 to 3e-14
    assert np.isnan(found.deviation).all()
    assert found["mass"] == found.value[0]
    with pytest.raises(KeyError, match="'density' is not a parameter"):
        found["density"]


def test_errors_are_within_the_deviations_of_the_noise(problem, held, frame):
    q, v = motion(held, 60)
    noise = np.random.default_rng(5).standard_normal(v.shape) * 1e-6
    found = grapnel.identify(held, frame, q, v + noise, angular_velocity=1e-6, velocity=1e-6, joint_rate=1e-6,
                             momentum=np.zeros(6))
    assert found.all_determined
    assert (found.deviation > 0).all()
    assert (np.abs(found.value - truth(problem)) < 4 * found.deviation).all()
    assert 0.5 < found.residual < 1.5
    sloppy = grapnel.identify(held, frame, q, v + noise, angular_velocity=1e-5, velocity=1e-5, joint_rate=1e-5,
                              momentum=np.zeros(6))
    assert sloppy.deviation[0] > 5 * found.deviation[0]


def test_undetermined_parameters_have_no_value(held, frame):
    q, v = motion(held, 5)
    nothing = grapnel.identify(held, frame, q, np.zeros_like(v))
    assert nothing.rank == 0 and np.isnan(nothing.value).all() and nothing.mass == "not_determined"
    assert len(nothing.unseen) == 10
    one = grapnel.identify(held, frame, q[0], v[0], momentum=np.zeros(6))  # one sample: six equations
    assert 0 < one.rank <= 6 and not one.all_determined
    assert all(isinstance(text, str) and "+ 1" in text for text in one.unseen)


def test_an_external_impulse_is_taken_into_account(problem, held, frame):
    q, v = motion(held, 30)
    # An impulse on the whole system: all samples except the first have an additional velocity.
    push = np.array([0.01, -0.02, 0.005])
    v = v.copy()
    v[1:, held.body_v(held.base)] += np.concatenate([np.zeros(3), push])
    impulse = np.zeros((30, 6))
    com = held.center_of_mass(q[1:])
    impulse[1:, 3:] = held.mass * push
    impulse[1:, :3] = held.mass * np.cross(com, push)
    found = grapnel.identify(held, frame, q, v, impulse=impulse)
    assert abs(found["mass"] - truth(problem)[0]) < 1e-6 * found["mass"]
    wrong = grapnel.identify(held, frame, q, v)
    assert abs(wrong["mass"] - truth(problem)[0]) > 1e-3 * found["mass"]


def test_messages(held, frame):
    q, v = motion(held, 3)
    with pytest.raises(ValueError, match="frame is 'target:unknown'.*one of the robot's frames"):
        grapnel.identify(held, "target:unknown", q, v)
    with pytest.raises(ValueError, match="base is 'rotaton'; did you mean 'rotation'"):
        grapnel.identify(held, frame, q, v, base="rotaton")
    with pytest.raises(ValueError, match="impulse has shape"):
        grapnel.identify(held, frame, q, v, impulse=np.zeros((3, 5)))
    with pytest.raises(ValueError, match="momentum has shape"):
        grapnel.identify(held, frame, q, v, momentum=np.zeros((3, 6)))
    with pytest.raises(ValueError, match="noise"):
        grapnel.identify(held, frame, q, v, joint_rate=-1)


def test_parameters_are_named_as_in_results():
    assert PARAMETERS == ("mass", "com_x", "com_y", "com_z", "inertia_xx", "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz",
                          "inertia_yz")
