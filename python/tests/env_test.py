"""Environments: shapes, rewards, terminations, and equality of one case and many."""

import subprocess
import sys

import numpy as np
import pytest
from conftest import HERE, THESIS, environment

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
    assert set(info) == {"captured", "diverged", "distance", "speed"} and info["distance"].shape == (2,)
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
    with pytest.raises(ValueError, match="nan"):
        env.step(np.full(6, np.nan))
