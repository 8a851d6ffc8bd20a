#!/usr/bin/env python3
"""Environments under random, saturated and invalid actions: a million steps of cases per scenario, and their speed.

usage: bench/env_steps.py [--steps N] [SCENARIO...]        (default: all shipped scenarios)

Every step checks that observations and rewards are finite and that each end has a reason. Needs the package: scripts/python
bench/env_steps.py builds it.
"""

import argparse
import collections
import pathlib
import time

import numpy as np

import grapnel
import grapnel.data
from grapnel.env import VectorCaptureEnv


def actions(random, n, joints):
    action = random.uniform(-1, 1, (n, joints)) * 10.0 ** random.integers(-2, 3, (n, 1))
    bad = random.random(n) < 1e-3
    action[bad, random.integers(joints)] = random.choice([np.nan, np.inf, -np.inf], np.count_nonzero(bad))
    return action


def environment(file, n=2048):
    """The environment of a scenario, or why it has none."""
    try:
        return VectorCaptureEnv(grapnel.load(file), n, effort_scale=20.0, duration=10.0, period=0.1, step=0.05)
    except ValueError as error:
        if "no grasps" in str(error) or "do not support" in str(error):
            return str(error)
        raise


def trial(env, steps):
    """Ends by reason, and steps per second."""
    n = env.n
    random, ends, spent = np.random.default_rng(1), collections.Counter(), 0.0
    env.reset(seed=1)
    for _ in range(-(-steps // n)):
        action = actions(random, n, env.robot.nu)
        begin = time.perf_counter()
        observation, reward, terminated, truncated, info = env.step(action)
        spent += time.perf_counter() - begin
        assert np.all(np.isfinite(observation)) and np.all(np.isfinite(reward))
        assert np.array_equal(terminated | truncated, info["reason"] != "")
        ends.update(info["reason"][info["reason"] != ""].tolist())
        ends.update(f"ledger {one}" for one in info["ledger"][info["captured"]])
        env.reset(cases=env.done)
    return ends, -(-steps // n) * n / spent


def main():
    arguments = argparse.ArgumentParser(usage=__doc__)
    arguments.add_argument("--steps", type=int, default=1_000_000)
    arguments.add_argument("scenario", nargs="*", type=pathlib.Path)
    given = arguments.parse_args()
    files = given.scenario or [grapnel.data.scenario(name) for name in grapnel.data.names()]
    for file in files:
        env = environment(file)
        if isinstance(env, str):
            print(f"{file.stem:36} no environment: {env}", flush=True)
            continue
        ends, speed = trial(env, given.steps)
        print(f"{file.stem:36} {speed:10.0f} steps/s  {', '.join(f'{count} {end}' for end, count in sorted(ends.items()))}", flush=True)


main()
