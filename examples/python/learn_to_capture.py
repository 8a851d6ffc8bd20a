"""Learn to capture tumbling targets: the cross-entropy method on random targets, then a test on 1,000 other cases.

Two arms with seven joints each reach for two tumbling targets. Place and spin of each target are random. The policy accelerates
each tip towards its grasp point like a spring of limited length with a damper, by the generalized Jacobian and the generalized
inertia of the floating robot, and damps the joints. Its four parameters are learned. A capture is an impact; it counts if its
ledger of momentum and energy passes.

    PYTHONPATH=build/release/python /usr/bin/python3 examples/python/learn_to_capture.py
"""

import pathlib
import sys
import time

import numpy as np

import grapnel
from grapnel.env import VectorCaptureEnv

CASES = int(sys.argv[2]) if len(sys.argv) > 2 else 1000  # of the test; the first argument of all examples is a folder
problem = grapnel.load(pathlib.Path(__file__).parents[2] / "scenarios" / "seven-joint-dual-capture.yaml")
robot = grapnel.Robot(problem)
random = np.random.default_rng(0)

PARAMETERS = ("frequency [rad/s]", "damping ratio", "joint damping [1/s]", "largest pull [m]")
START = np.log([0.2, 0.3, 1.0, 0.2])


def tumbling(generator, q, v):
    """Each target within reach, at a random place within 0.1 m, with a random spin of at most 0.06 rad/s."""
    for name in ("target:" + target.name for target in problem.targets):
        place = env.robot.q_names.index(f"{name}/x")
        spin = env.robot.v_names.index(f"{name}/wx")
        q[:, place:place + 3] = 0.8 * q[:, place:place + 3] + generator.uniform(-0.1, 0.1, (len(q), 3))
        axis = generator.standard_normal((len(q), 3))
        v[:, spin:spin + 3] = generator.uniform(0, 0.06, (len(q), 1)) * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    return q, v


def environment(cases):
    return VectorCaptureEnv(problem, cases, period=0.2, step=0.05, duration=30.0, effort_scale=50.0, perturb=tumbling,
                            reward={"approach": 1, "capture": 3, "effort": 0.5, "impulse": 0.2})


def actions(parameters):
    """Actions for all cases; `parameters` (cases, 4): logarithms of PARAMETERS."""
    frequency, ratio, joint_damping, reach = np.exp(parameters).T[:, :, None]
    distance, velocity, _ = env.relative(env.state)
    q, v = env.rollout.split(env.state)
    own = q[:, :robot.nq]
    wanted = []
    for k in range(len(env.grasps)):
        length = np.linalg.norm(distance[:, k], axis=1, keepdims=True)
        pull = distance[:, k] * np.minimum(1, reach / np.maximum(length, 1e-9))
        wanted.append(frequency**2 * pull + 2 * ratio * frequency * velocity[:, k])
    wanted = np.concatenate(wanted, axis=1)
    J = np.concatenate([robot.generalized_jacobian(grasp["end_effector"], own)[:, 3:] for grasp in env.grasps], axis=1)
    inverse = np.linalg.inv(J @ J.transpose(0, 2, 1) + 0.01 * np.eye(J.shape[1]))
    rates = v[:, env.robot.joint_v]
    wanted += joint_damping * np.einsum("nij,nj->ni", J, rates)  # damps joint motion that leaves the tips at rest
    acceleration = np.einsum("nij,ni->nj", J, np.einsum("nij,nj->ni", inverse, wanted)) - joint_damping * rates
    return np.einsum("nij,nj->ni", robot.generalized_inertia(own), acceleration) / env.effort_scale


def play(parameters, seed):
    """Episodes of all cases: sums of rewards, reasons of their ends, ledgers, and impulses [N s]."""
    env.reset(seed=seed)
    total, ledger, impulse = np.zeros(env.n), np.full(env.n, "not checked"), np.full(env.n, np.nan)
    while not np.all(env.done):
        _, reward, _, _, info = env.step(actions(parameters))
        total += reward
        captured = info["captured"]
        ledger[captured] = info["ledger"][captured]
        impulse[captured] = np.linalg.norm(info["impulse"][captured][:, :, 3:], axis=2).sum(axis=1)
    return total, info["reason"], ledger, impulse


begin = time.monotonic()
draws, targets, elite, rounds = 24, 8, 6, 6
env = environment(draws * targets)
mean, deviation = START.copy(), np.full(4, 1.0)
for turn in range(rounds):
    parameters = mean + deviation * random.standard_normal((draws, 4))
    parameters[0] = mean
    total, reason, *_ = play(np.repeat(parameters, targets, axis=0), seed=turn)
    score = total.reshape(draws, targets).mean(axis=1)
    best = np.argsort(-score)[:elite]
    mean, deviation = parameters[best].mean(axis=0), parameters[best].std(axis=0) + 0.03
    print(f"round {turn + 1}: mean reward {score.mean():.3f}, of the best {score[best[0]]:.3f}, captures {np.mean(reason == 'captured'):.0%}")
print(f"learned in {time.monotonic() - begin:.0f} s: " + ", ".join(f"{name} {np.exp(x):.3g}" for name, x in zip(PARAMETERS, mean)))

env = environment(CASES)
shares = {}
for name, parameters in (("before", START), ("learned", mean)):
    total, reason, ledger, impulse = play(np.tile(parameters, (CASES, 1)), seed=1000)
    shares[name] = np.mean((reason == "captured") & (ledger == "yes"))
    print(f"{name}: {np.count_nonzero(reason == 'captured')} of {CASES} cases captured, {np.count_nonzero(ledger == 'yes')} with a valid ledger, "
          f"mean reward {total.mean():.3f}" + (f", median impulse {np.nanmedian(impulse):.3f} N s" if np.any(ledger == "yes") else ""))
assert shares["learned"] > shares["before"] and shares["learned"] > 0.9
