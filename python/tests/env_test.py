"""Environments: shapes, rewards, terminations, and equality of one case and many."""

import dataclasses
import subprocess
import sys

import numpy as np
import pytest
from conftest import HERE, SOURCE, THESIS, environment

import grapnel
from grapnel.env import CaptureEnv, VectorCaptureEnv


@pytest.fixture
def problem():
    return grapnel.load(THESIS)


def test_spaces_and_one_step(problem):
    env = CaptureEnv(problem, effort_scale=5.0)
    observation, info = env.reset(seed=1)
    assert env.action_space.shape == (6,) and observation.shape == env.observation_space.shape == (2 * 6 + 3 + 2 * 6,)
    assert info == {} and env.observation_space.contains(observation) and env.action_space.contains(env.action_space.sample())
    observation, reward, terminated, truncated, info = env.step(np.zeros(6))
    assert isinstance(reward, float) and terminated is False and truncated is False
    assert set(info) == {"captured", "diverged", "distance", "speed", "impulse", "energy_loss", "momentum_drift", "ledger", "reason"}
    assert info["distance"].shape == (2,) and info["ledger"] == "not checked" and info["reason"] == ""
    env.close()


def test_observations_match_the_state(problem):
    env = VectorCaptureEnv(problem, 3, effort_scale=5.0)
    env.reset()
    observation, *_ = env.step(np.random.default_rng(0).uniform(-1, 1, (3, 6)))
    robot = env.robot
    q, v = env.rollout.split(env.state)
    assert np.array_equal(observation[:, :6], q[:, robot.joint_q]) and np.array_equal(observation[:, 6:12], v[:, robot.joint_v])
    assert np.allclose(observation[:, 12:15], v[:, :3])  # the base's angular velocity in its own axes
    R = robot.frame_pose("base", q)[:, :3, :3]
    point = robot.frame_pose("target:target-1", q) @ np.array([0, 0.5, 0, 1])
    tip = robot.frame_pose("tip-1", q)[:, :3, 3]
    assert np.allclose(np.einsum("nij,nj->ni", R, observation[:, 15:18]), point[:, :3] - tip)


def test_relative_velocity_is_the_rate_of_the_distance(problem):
    env = VectorCaptureEnv(problem, 1, effort_scale=5.0, period=1e-4, step=1e-4)
    env.reset()
    env.step(np.ones((1, 6)))
    before, velocity, _ = env.relative(env.state)
    env.step(np.zeros((1, 6)))
    after, later, _ = env.relative(env.state)
    assert np.allclose((after - before) / 1e-4, 0.5 * (velocity + later), atol=1e-6) and np.linalg.norm(velocity) > 0.01


def test_one_is_a_case_of_many(problem):
    actions = np.random.default_rng(3).uniform(-1, 1, (5, 11, 6))
    many = VectorCaptureEnv(problem, 11, effort_scale=5.0)
    many.reset()
    one = CaptureEnv(problem, effort_scale=5.0)
    one.reset()
    for action in actions:
        observations, rewards, *_ = many.step(action)
        observation, reward, *_ = one.step(action[4])
        assert np.array_equal(observations[4], observation) and rewards[4] == reward


def test_rewards_add_up_and_captures_end(problem):
    # With tolerances that the initial state satisfies, the first step is a capture.
    env = VectorCaptureEnv(problem, 2, effort_scale=5.0, position=100, velocity=100)
    env.reset()
    before = env._potential.copy()
    _, reward, terminated, truncated, info = env.step(np.zeros((2, 6)))
    assert np.all(terminated) and not np.any(truncated) and np.all(info["captured"])
    assert np.allclose(reward, before - env._potential + 1)
    state = env.state.copy()
    _, reward, terminated, truncated, _ = env.step(np.ones((2, 6)))
    assert np.array_equal(state, env.state) and not np.any(reward) and not np.any(terminated | truncated)
    env.reset(cases=np.array([True, False]))
    env.step(np.ones((2, 6)))
    assert np.array_equal(env.state[1], state[1]) and not np.array_equal(env.state[0], state[0])


def test_episodes_are_truncated_at_their_duration(problem):
    env = VectorCaptureEnv(problem, 2, effort_scale=5.0, duration=0.3, period=0.1)
    env.reset()
    ends = [env.step(np.zeros((2, 6)))[3] for _ in range(3)]
    assert [bool(end.all()) for end in ends] == [False, False, True]


@pytest.mark.parametrize("scale", [1e4, 1e6, 1e9, 1e150])
def test_diverged_cases_end_without_affecting_others(problem, scale):
    env = VectorCaptureEnv(problem, 12, effort_scale=scale, duration=10)
    quiet = VectorCaptureEnv(problem, 1, effort_scale=scale, duration=10)
    env.reset(), quiet.reset()
    random = np.random.default_rng(3)
    diverged = np.zeros(12, dtype=bool)
    for _ in range(30):
        action = random.uniform(-1, 1, (12, 6))
        action[0] = 0
        observation, reward, terminated, truncated, info = env.step(action)
        assert np.all(np.isfinite(observation)) and np.all(np.isfinite(reward)) and np.all(np.isfinite(info["distance"]))
        assert np.all(terminated[info["diverged"]]) and not np.any(info["captured"] & info["diverged"])
        diverged |= info["diverged"]
        assert np.array_equal(quiet.step(np.zeros((1, 6)))[0][0], observation[0])
    assert np.all(diverged[1:]) and np.all(env.done[1:]) and not diverged[0] and not env.done[0]
    env.reset(cases=diverged)
    env.step(np.zeros((12, 6)))
    assert not np.any(env.done)


def test_wheels_have_actions(tmp_path):
    (tmp_path / "wheels.yaml").write_text(f"""
name: wheels
robot:
  base: {{mass: 100, inertia: [10, 10, 10]}}
  links:
    - {{name: arm, parent: base, joint: {{name: shoulder, type: revolute, axis: [0, 0, 1]}}, mass: 5, inertia: [1, 1, 1]}}
  end_effectors: [{{name: tip, link: arm, position: [1, 0, 0]}}]
  wheels: [{{name: spin, axis: [0, 0, 1], inertia: 0.1}}]
initial: {{joints: [0]}}
targets:
  - {{name: ball, mass: 1, inertia: [1, 1, 1], state: {{position: [1, 1, 0]}}, grasp_points: [{{name: at}}]}}
grasps: [{{end_effector: tip, target: ball, point: at}}]
impact: {{}}
""")
    env = VectorCaptureEnv(grapnel.load(tmp_path / "wheels.yaml"), 1, effort_scale=1.0)
    assert env.robot.joints == ["shoulder", "wheel:spin"] and env.single_action_space.shape == (2,)
    env.reset()
    observation, *_ = env.step(np.array([[0.0, 1.0]]))
    assert observation[0, 6] < 0  # the base rotates against the wheel, about z


def test_perturbed_initial_states_are_reproducible(problem):
    def perturb(random, q, v):
        q[:, 7:13] += random.uniform(-0.1, 0.1, (len(q), 6))
        return q, v

    first, second = (VectorCaptureEnv(problem, 4, effort_scale=5.0, perturb=perturb) for _ in range(2))
    a, _ = first.reset(seed=5)
    b, _ = second.reset(seed=5)
    assert np.array_equal(a, b) and not np.array_equal(a[0], a[1])


@pytest.mark.parametrize("folder", ["with_gymnasium", "without"])
def test_with_gymnasium_and_without(folder):
    """All other tests of this file, and the requirements of gymnasium's checks."""
    settings = environment(folder)
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", HERE / "env_test.py", "-k",
                           "not with_gymnasium_and_without"], capture_output=True, text=True, env=settings, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    code = f"""
import numpy
import grapnel
from grapnel.env import Box, CaptureEnv, VectorCaptureEnv

problem = grapnel.load({str(THESIS)!r})
env = CaptureEnv(problem, effort_scale=5.0)
assert {folder == "without"} == isinstance(env.action_space, Box)
if {folder == "with_gymnasium"}:
    import gymnasium
    assert isinstance(env, gymnasium.Env) and env.unwrapped is env and env.spec is None and env.render_mode is None
    for space in (env.action_space, env.observation_space, VectorCaptureEnv(problem, 2, effort_scale=5.0).action_space):
        assert type(space) is gymnasium.spaces.Box and space.dtype == numpy.float64
    with env as inside:
        inside.reset(seed=3)
        assert env._np_random_seed == 3  # required by check_env
        env.reset(seed=3, options={{}})
observation, info = env.reset(seed=1)
env.action_space.seed(1)
assert env.observation_space.contains(observation) and info == {{}}
observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
assert env.observation_space.contains(observation) and type(reward) is float and type(terminated) is type(truncated) is bool
print("all of it")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=settings, check=False)
    assert done.returncode == 0 and done.stdout == "all of it\n", done.stderr


def test_a_step_before_the_first_reset_is_an_error(problem):
    with pytest.raises(RuntimeError, match="before the first reset"):
        VectorCaptureEnv(problem, 2, effort_scale=5.0).step(np.zeros((2, 6)))


@pytest.mark.parametrize("settings, message", [
    ({"effort_scale": 5, "duration": float("nan")}, "duration is nan"), ({"effort_scale": 5, "duration": -1}, "duration is -1"),
    ({"effort_scale": 5, "period": float("inf")}, "both finite"), ({"effort_scale": 5, "position": float("nan")}, "position is nan"),
    ({"effort_scale": 5, "threads": -3}, "threads is -3"), ({"effort_scale": [1, 2]}, r"effort_scale has shape \(2,\)"),
    ({}, "effort_scale"), ({"effort_scale": -1}, "effort_scale"), ({"effort_scale": 5, "step": 0.2}, "0 < step <= period"),
    ({"effort_scale": 5, "position": None, "n": 0}, "n is 0")])
def test_wrong_settings(problem, settings, message):
    settings = dict(settings)
    with pytest.raises(ValueError, match=message):
        VectorCaptureEnv(problem, settings.pop("n", 1), **settings)


def test_wrong_actions(problem):
    env = CaptureEnv(problem, effort_scale=5.0)
    env.reset()
    with pytest.raises(ValueError, match=r"expected \(6,\)"):
        env.step(np.zeros(3))


def test_actions_that_are_not_finite_end_their_case(problem):
    env = VectorCaptureEnv(problem, 4, effort_scale=5.0, reward={"diverged": 2})
    env.reset()
    action = np.ones((4, 6))
    action[1, 2], action[2, 0] = np.nan, np.inf
    observation, reward, terminated, truncated, info = env.step(action)
    assert list(terminated) == [False, True, True, False] and list(info["reason"]) == ["", "invalid action", "invalid action", ""]
    assert list(reward) == [0, -2, -2, 0] and not np.any(truncated) and np.all(np.isfinite(observation))
    assert np.array_equal(env.state[1], env._start) and not np.array_equal(env.state[0], env._start)


def test_a_capture_is_an_impact_with_a_ledger(problem):
    env = VectorCaptureEnv(problem, 3, effort_scale=5.0, position=100, velocity=100)
    env.reset()
    observation, _, _, _, info = env.step(np.random.default_rng(1).uniform(-1, 1, (3, 6)))
    assert list(info["ledger"]) == ["yes"] * 3 and list(info["reason"]) == ["captured"] * 3
    assert np.all(info["momentum_drift"] < 1e-8) and np.all(info["energy_loss"] > 0)
    q, v = env.rollout.split(env.state)
    pairs = [(grasp["end_effector"], grasp["target"]) for grasp in env.grasps]
    again = env.robot.impact(q, v, pairs)  # the end-effectors have the targets' velocities now
    assert np.max(np.abs(again.impulse)) < 1e-12 < 1e-3 < np.max(np.abs(info["impulse"]))
    assert np.allclose(observation, env.observe(env.state), rtol=0, atol=0)
    momentum = env.robot.momentum(q, v, np.zeros(3))
    assert np.allclose(momentum, env._momentum, rtol=0, atol=1e-6)  # steps of order 4
    # The robot's momentum is the sum of the impulses: it had none before.
    robot = env.robot.momentum(q, np.where(np.arange(env.robot.nv) < 12, v, 0), np.zeros(3))[:, 3:]
    assert np.allclose(info["impulse"][:, :, 3:].sum(axis=1), robot, rtol=0, atol=1e-6)


def test_a_drift_of_momentum_makes_the_ledger_no(problem):
    env = VectorCaptureEnv(problem, 2, effort_scale=5.0, position=100, velocity=100)
    env.reset()
    env._momentum[1, 4] += 0.1
    info = env.step(np.zeros((2, 6)))[-1]
    assert list(info["ledger"]) == ["yes", "no"]


def test_an_impact_without_effect_makes_the_ledger_no(problem, monkeypatch):
    env = VectorCaptureEnv(problem, 1, effort_scale=5.0, position=100, velocity=100)
    env.reset()
    own = env.robot.impact

    def nothing(q, v, pairs):
        found = own(q, v, pairs)
        return dataclasses.replace(found, velocity=v, impulse=0 * found.impulse, kinetic_energy_after=found.kinetic_energy_before)

    monkeypatch.setattr(env.robot, "impact", nothing)
    assert env.step(np.zeros((1, 6)))[-1]["ledger"][0] == "no"


@pytest.mark.parametrize("place, velocity", [(0, 0), (6.8e6, 0), (0, 1e3)])
def test_the_ledger_does_not_depend_on_the_world_frame(problem, place, velocity):
    """Far from the origin, and with a common velocity, captures are valid, and a wrong momentum is found."""
    def moved(_random, q, v):
        for body in ("base", "target:target-1", "target:target-2"):
            q[:, env.robot.q_names.index(f"{body}/x")] += place
            first = env.robot.v_names.index(f"{body}/vx")
            v[:, first:first + 3] += velocity * env.robot.frame_pose(body, q)[:, 0, :3]  # along x of W, in the body's axes
        return q, v

    env = VectorCaptureEnv(problem, 2, effort_scale=5.0, position=100, velocity=100, perturb=moved)
    env.reset()
    env._momentum[1, 5] += 0.1
    info = env.step(np.random.default_rng(1).uniform(-1, 1, (2, 6)))[-1]
    assert list(info["ledger"]) == ["yes", "no"], info["momentum_drift"]


def test_a_capture_at_rest_after_fast_motion_is_valid(problem):
    env = VectorCaptureEnv(problem, 1, effort_scale=5.0, position=100, velocity=100)
    env.reset()
    tolerances, env._tolerances = env._tolerances, [(0.0, 0.0, 0.0)] * 2
    for k in range(40):
        env.step(np.full((1, 6), 1.0 if k < 20 else -1.0))
    q, v = env.rollout.split(env.state)
    env.state[:] = env.rollout.state(q, 1e-9 * v)  # stopped, which changes the momentum of each body but not their sum by much
    env._momentum[:] = env.robot.momentum(q, 1e-9 * v)
    env._tolerances = tolerances
    info = env.step(np.zeros((1, 6)))[-1]
    assert info["ledger"][0] == "yes" and info["momentum_drift"][0] < 1e-6


def test_wrong_perturbations_name_themselves(problem):
    for made, message in ((lambda random, q, v: None, "perturb returned NoneType"), (lambda random, q, v: (q * np.nan, v), "invalid state"),
                          (lambda random, q, v: (q[:1], v[:1]), "shape")):
        env = VectorCaptureEnv(problem, 3, effort_scale=5.0, perturb=made)
        with pytest.raises(ValueError, match=message):
            env.reset()


def test_the_step_is_at_most_the_requested_one(problem):
    assert VectorCaptureEnv(problem, 1, effort_scale=5.0, period=0.1, step=0.07).rollout.step == 0.05


@pytest.mark.parametrize("file", sorted((SOURCE / "scenarios").rglob("*.yaml")), ids=lambda file: str(file.relative_to(SOURCE / "scenarios")))
def test_captures_of_all_scenarios_are_valid(file):
    """Tolerances that the first step satisfies: several arms, closed loops, held bases, wheels, gravity."""
    problem = grapnel.load(file)
    try:
        env = VectorCaptureEnv(problem, 2, effort_scale=1e-3, period=0.02, step=0.01, position=1e3, velocity=1e3, angular_velocity=1e3)
    except ValueError as error:
        assert "no grasps" in str(error) or "do not support" in str(error)
        return
    env.reset()
    info = env.step(np.ones((2, env.robot.nu)))[-1]
    assert list(info["ledger"]) == ["yes"] * 2, info
    if env._conserves:
        assert np.all(info["momentum_drift"] < 1e-6)


def test_names_and_units(problem):
    env = VectorCaptureEnv(problem, 1, effort_scale=5.0)
    observation, _ = env.reset()
    assert len(env.observation_names) == len(env.observation_units) == observation.shape[1]
    assert env.observation_names[0] == "position/arm-1-joint-1" and env.observation_units[0] == "rad"
    k = env.observation_names.index("distance/tip-2/y")
    q, _ = env.rollout.split(env.state)
    R = env.robot.frame_pose(env.robot.base, q)[0, :3, :3]
    assert observation[0, k] == pytest.approx((R.T @ env.relative(env.state)[0][0, 1])[1]) and env.observation_units[k] == "m"
    assert env.action_names == env.robot.joints and set(env.action_units) == {"1"}


def test_rewards_are_weights_or_a_function(problem):
    actions = np.random.default_rng(1).uniform(-1, 1, (5, 6))
    seen = {}

    def own(terms):
        seen.update(terms)
        return terms["effort"] * 3

    weighted, function = (VectorCaptureEnv(problem, 5, effort_scale=5.0, reward=one) for one in ({"effort": 3.0}, own))
    weighted.reset(), function.reset()
    reward = weighted.step(actions)[1]
    assert np.array_equal(reward, function.step(actions)[1]) and np.allclose(reward, -0.3 * np.mean(actions**2, axis=1))
    assert set(seen) == set(grapnel.env.REWARD_TERMS)
    with pytest.raises(ValueError, match="'speed'; expected some of approach"):
        VectorCaptureEnv(problem, 1, effort_scale=5.0, reward={"speed": 1})
    with pytest.raises(TypeError, match="reward is 3"):
        VectorCaptureEnv(problem, 1, effort_scale=5.0, reward=3)


SCENARIOS = sorted((SOURCE / "scenarios").rglob("*.yaml"))


@pytest.mark.parametrize("file", SCENARIOS, ids=lambda file: str(file.relative_to(SOURCE / "scenarios")))
def test_no_action_raises(file):
    """Random, saturated and invalid actions, with resets of the cases that have ended."""
    problem = grapnel.load(file)
    try:
        env = VectorCaptureEnv(problem, 16, effort_scale=20.0, duration=3.0, period=0.1, step=0.05)
    except ValueError as error:
        assert any(text in str(error) for text in ("no grasps", "do not support")), error
        return
    random = np.random.default_rng(4)
    env.reset(seed=1)
    for k in range(40):
        action = random.normal(0, 10.0 ** random.integers(-2, 3), (16, env.robot.nu))
        if k % 3 == 0:
            action[random.integers(16), random.integers(env.robot.nu)] = random.choice([np.nan, np.inf, -np.inf, 1e308])
        observation, reward, terminated, truncated, info = env.step(action)
        assert np.all(np.isfinite(observation)) and np.all(np.isfinite(reward))
        ended = terminated | truncated
        assert np.array_equal(ended, info["reason"] != "") and np.array_equal(ended, env.done)  # all were reset
        assert np.array_equal(info["ledger"] != "not checked", info["captured"])
        env.reset(cases=env.done)
