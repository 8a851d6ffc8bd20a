"""Policy search: the cross-entropy method finds gains that bring a tip to rest at its grasp point.

The policy is a spring and a damper between tip and grasp point, mapped to joint torques by the generalized Jacobian, and
damping in the joints. The search draws its three parameters, evaluates them on a batch of captures with different initial
joint values, and updates the distribution from the best draws.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/search_policy.py
"""

import pathlib

import numpy as np

import grapnel
from grapnel.env import VectorCaptureEnv

scenarios = pathlib.Path(__file__).parents[2] / "scenarios"
problem = grapnel.load(scenarios / "first-plan.yaml")
servicer = grapnel.Robot(problem)

draws, starts, elite, rounds = 24, 4, 6, 6
random = np.random.default_rng(0)


def perturb(generator, q, v):
    """Offsets the initial joint values, by the same amounts for all draws."""
    offsets = np.random.default_rng(7).uniform(-0.05, 0.05, (starts, env.robot.nu))
    q[:, env.robot.joint_q] += np.tile(offsets, (draws, 1))
    return q, v


env = VectorCaptureEnv(problem, draws * starts, period=0.2, step=0.04, duration=20.0, effort_scale=20.0, perturb=perturb)
tip = env.grasps[0]["end_effector"]
nq, nv = servicer.nq, servicer.nv


def torques(parameters):
    """Efforts of all cases, relative to the scale. `parameters` (draws, 3): log of stiffness, damping, joint damping."""
    stiffness, damping, joint_damping = np.repeat(np.exp(parameters), starts, axis=0).T[:, :, None]
    distance, velocity, _ = env.relative(env.state)
    q, v = env.rollout.split(env.state)
    J = servicer.generalized_jacobian(tip, q[:, :nq])[:, 3:]
    force = stiffness * distance[:, 0] + damping * velocity[:, 0]
    effort = np.einsum("nij,ni->nj", J, force) - joint_damping * v[:, env.robot.joint_v]
    return effort / env.effort_scale


def score(parameters):
    """Cost of each draw (mean final distance plus speed) and its share of captures."""
    env.reset()
    captured = np.zeros(env.n, dtype=bool)
    while not np.all(env.done):
        *_, info = env.step(torques(parameters))
        captured |= info["captured"]
    distance, velocity, _ = env.relative(env.state)
    cost = env._potential_of(distance, velocity).reshape(draws, starts)
    return cost.mean(axis=1), captured.reshape(draws, starts).mean(axis=1)


mean, deviation = np.log([1.0, 10.0, 1.0]), np.full(3, 1.5)
for turn in range(rounds):
    parameters = mean + deviation * random.standard_normal((draws, 3))
    parameters[0] = mean
    cost, captured = score(parameters)
    best = np.argsort(cost)[:elite]
    mean, deviation = parameters[best].mean(axis=0), parameters[best].std(axis=0) + 0.05
    print(f"round {turn + 1}: best cost {cost[best[0]]:.4f}, captures {captured[best[0]]:.0%}, gains "
          + ", ".join(f"{gain:.3g}" for gain in np.exp(parameters[best[0]])))

first = score(np.tile(np.log([1.0, 10.0, 1.0]), (draws, 1)))[0].mean()
print(f"cost {first:.3f} before, {cost.min():.4f} after the search")
assert cost.min() < 0.5 * first
