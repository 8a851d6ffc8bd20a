"""Captures as environments for reinforcement learning and search: reset and step, for one case or many.

The interface is that of gymnasium, which is optional. `grapnel.Rollout` computes the motion with fixed steps in SIMD lanes; the
targets are free and no grasp closes. Verify a policy with `Problem.simulate`, which evaluates the capture with error control,
contact and conservation checks.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ._arguments import Array, thread_count, whole_number
from .robot import Rollout
from .scenario import Problem

try:
    import gymnasium as _gymnasium
except ImportError:
    _gymnasium = None

#: Changes the initial states of some cases: (generator, q (n, nq), v (n, nv)) -> (q, v).
Perturb = Callable[[np.random.Generator, Array, Array], "tuple[Array, Array]"]


class Box:
    """A box of real numbers; replaces gymnasium.spaces.Box if gymnasium is not installed."""

    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        self.shape, self.dtype = self.low.shape, np.dtype(np.float64)
        self._random = np.random.default_rng()

    def seed(self, seed: int | None = None) -> None:
        """Sets the seed of subsequent samples."""
        self._random = np.random.default_rng(seed)

    def sample(self) -> Array:
        """A random point: uniform in finite intervals, else normal."""
        finite = np.isfinite(self.low) & np.isfinite(self.high)
        return np.where(finite, self._random.uniform(np.where(finite, self.low, 0), np.where(finite, self.high, 1)),
                        self._random.standard_normal(self.shape))

    def contains(self, x: Any) -> bool:
        """Whether x has the shape of the box and lies inside."""
        x = np.asarray(x)
        return x.shape == self.shape and bool(np.all(x >= self.low) and np.all(x <= self.high))

    def __repr__(self) -> str:
        return f"Box(shape={self.shape})"


def _box(low: Array, high: Array) -> Any:
    if _gymnasium is None:
        return Box(low, high)
    return _gymnasium.spaces.Box(low, high, dtype=np.float64)


#: Speed above which a case of an environment has diverged [rad/s or m/s].
RUNAWAY = 1e5


def _quaternions_of(robot: Any) -> list[int]:
    """Indices in q at which the quaternions of free bodies begin."""
    names = robot.q_names
    return [i for i, name in enumerate(names[:-3]) if name.endswith("/qw") and names[i + 1] == name[:-1] + "x"]


class VectorCaptureEnv:
    """`n` simultaneous captures of one problem.

    Observation of a case: joint values [rad, m], joint rates, the base's angular velocity [rad/s], and for each grasp the vector
    from the end-effector to its grasp point [m] and the grasp point's velocity relative to the end-effector [m/s], all in the
    base's axes.

    Action: an effort per joint as a fraction of `effort_scale`, between -1 and 1, held for `period` [s]. Joints have the order of
    `env.robot.joints`. They are the joints of the arms and, if the robot has them, the reaction wheels (`wheel:NAME`), the gimbals
    and rotors of control moment gyros (`gyro:NAME`, `gyro-rotor:NAME`) and joints with springs, which accept efforts here like all
    other joints. Send 0 for no effort.

    Reward of a step: the decrease of sum(distance + 1 s * relative speed) over the grasps [m], plus 1 at the capture. In a
    capture every end-effector is within `position` [m], `velocity` [m/s] and `angular_velocity` [rad/s] of its grasp point. The
    defaults are those of its envelope, or 0.05 m and 0.05 m/s without an envelope. Angles of envelopes are not evaluated.

    End of a case: at the capture (terminated), at `duration` (truncated), or when it diverges (terminated, and `diverged` in the
    dictionary of step()). A case diverges if a speed exceeds `RUNAWAY` (rad/s or m/s) or its state is not valid. It then keeps its
    last valid state. A case that has ended keeps its state, with rewards of 0, until it is reset.
    """

    def __init__(self, problem: Problem, n: int, period: float = 0.1, step: float = 0.02, duration: float | None = None,
                 effort_scale: Any = None, position: float | None = None, velocity: float | None = None,
                 angular_velocity: float | None = None, method: str = "rk4", perturb: Perturb | None = None,
                 threads: int = 0) -> None:
        if not (0 < step <= period < math.inf):
            raise ValueError(f"step is {step}, period {period}; expected 0 < step <= period, both finite")
        if duration is not None and not 0 < duration < math.inf:
            raise ValueError(f"duration is {duration}; expected a positive and finite time")
        for name, tolerance in (("position", position), ("velocity", velocity), ("angular_velocity", angular_velocity)):
            if tolerance is not None and not tolerance >= 0:
                raise ValueError(f"{name} is {tolerance}; expected a tolerance that is not negative")
        n = whole_number("n", n, 1, 2**31)
        substeps = round(period / step)
        self.rollout = Rollout(problem, period / substeps, substeps, method)
        self.robot = self.rollout.robot
        self.n, self.period, self.threads, self.perturb = n, float(period), thread_count(threads), perturb
        self.duration = float(duration if duration is not None else self.robot._core.approach_duration or 20.0)
        self.grasps: list[dict[str, Any]] = self.robot._core.grasps
        if not self.grasps:
            raise ValueError("the problem has no grasps; an environment needs at least one grasp as its goal")
        self._tolerances = [self._tolerance(grasp, position, velocity, angular_velocity) for grasp in self.grasps]
        self.effort_scale = self._scale(effort_scale)
        self._start = self.rollout.state(*self.robot.initial_state())
        self._quaternions = _quaternions_of(self.robot)
        self._random = np.random.default_rng()
        size = 2 * self.robot.nu + 3 + 6 * len(self.grasps)
        self.single_observation_space = _box(np.full(size, -np.inf), np.full(size, np.inf))
        self.single_action_space = _box(np.full(self.robot.nu, -1.0), np.full(self.robot.nu, 1.0))
        self.observation_space = _box(np.full((n, size), -np.inf), np.full((n, size), np.inf))
        self.action_space = _box(np.full((n, self.robot.nu), -1.0), np.full((n, self.robot.nu), 1.0))
        self.state = np.tile(self._start, (n, 1))  #: [q; v] of every case
        self.time = np.zeros(n)  #: time of every case [s]
        self.done = np.ones(n, dtype=bool)  #: cases that have ended, and all before the first reset
        self._potential = np.zeros(n)
        self._is_reset = False

    @property
    def num_envs(self) -> int:
        """The number of cases n, with gymnasium's name."""
        return self.n

    @staticmethod
    def _tolerance(grasp: dict[str, Any], position: float | None, velocity: float | None,
                   angular_velocity: float | None) -> tuple[float, float, float]:
        envelope = grasp["envelope"] or {"position": 0.05, "velocity": 0.05, "angular_velocity": np.inf}
        return (envelope["position"] if position is None else position,
                envelope["velocity"] if velocity is None else velocity,
                envelope["angular_velocity"] if angular_velocity is None else angular_velocity)

    def _scale(self, effort_scale: Any) -> Array:
        scale = np.array(self.robot.effort_limit if effort_scale is None else effort_scale, dtype=float)
        if scale.shape not in ((), (self.robot.nu,)):
            raise ValueError(f"effort_scale has shape {scale.shape}, expected one number, or ({self.robot.nu},)")
        scale = np.array(np.broadcast_to(scale, (self.robot.nu,)))
        if not np.all(np.isfinite(scale) & (scale > 0)):
            raise ValueError("effort_scale must be positive and finite for every joint; the robot file has no effort "
                             "limits for some joints, so specify it: effort_scale=5.0")
        return scale

    # ---- Geometry ----

    def relative(self, state: Array) -> tuple[Array, Array, Array]:
        """For states (n, nstate): vectors from end-effectors to grasp points [m], and the grasp points' velocity [m/s] and the
        targets' angular velocity [rad/s] relative to the end-effectors, (n, grasps, 3) each, in W."""
        q, v = self.rollout.split(np.atleast_2d(state))
        distances, velocities, turns = [], [], []
        for grasp in self.grasps:
            X_WE, V_WE = self.robot.frame_pose(grasp["end_effector"], q), self.robot.frame_twist(grasp["end_effector"], q, v)
            X_WT, V_WT = self.robot.frame_pose(grasp["target"], q), self.robot.frame_twist(grasp["target"], q, v)
            arm = X_WT[:, :3, :3] @ np.asarray(grasp["position"])
            distances.append(X_WT[:, :3, 3] + arm - X_WE[:, :3, 3])
            velocities.append(V_WT[:, 3:] + np.cross(V_WT[:, :3], arm) - V_WE[:, 3:])
            turns.append(V_WT[:, :3] - V_WE[:, :3])
        return np.stack(distances, axis=1), np.stack(velocities, axis=1), np.stack(turns, axis=1)

    def observe(self, state: Array) -> Array:
        """Observations of states, (n, size)."""
        return self._observe(np.atleast_2d(state), *self.relative(state)[:2])

    def _observe(self, state: Array, distance: Array, velocity: Array) -> Array:
        q, v = self.rollout.split(state)
        R_WB = self.robot.frame_pose(self.robot.base, q)[:, :3, :3]
        w_WB = self.robot.frame_twist(self.robot.base, q, v)[:, :3]
        in_base = [np.einsum("nji,nj->ni", R_WB, w_WB)]
        for g in range(len(self.grasps)):
            in_base += [np.einsum("nji,nj->ni", R_WB, x[:, g]) for x in (distance, velocity)]
        return np.concatenate([q[:, self.robot.joint_q], v[:, self.robot.joint_v], *in_base], axis=1)

    @staticmethod
    def _potential_of(distance: Array, velocity: Array) -> Array:
        return np.asarray((np.linalg.norm(distance, axis=2) + np.linalg.norm(velocity, axis=2)).sum(axis=1))

    def _captured(self, distance: Array, velocity: Array, turn: Array) -> Array:
        captured = np.ones(len(distance), dtype=bool)
        for g, (position, speed, rate) in enumerate(self._tolerances):
            captured &= np.linalg.norm(distance[:, g], axis=1) <= position
            captured &= np.linalg.norm(velocity[:, g], axis=1) <= speed
            captured &= np.linalg.norm(turn[:, g], axis=1) <= rate
        return captured

    def _sound(self, state: Array) -> Array:
        """Which states (n, nstate) are valid: finite, no faster than RUNAWAY, with unit quaternions."""
        finite = np.all(np.isfinite(state), axis=1)
        q, v = self.rollout.split(np.where(finite[:, None], state, 0))
        sound = finite & np.all(np.abs(v) <= RUNAWAY, axis=1)
        for first in self._quaternions:
            sound &= np.abs(np.linalg.norm(q[:, first:first + 4], axis=1) - 1) <= 1e-9
        return np.asarray(sound)

    # ---- Environment ----

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None,
              cases: Array | None = None) -> tuple[Array, dict[str, Any]]:
        """Resets all cases, or those of `cases` (indices or booleans), to the problem's initial state, changed by `perturb`.
        Returns observations (n, size) and an empty dictionary."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self._is_reset = True
        which = np.arange(self.n) if cases is None else np.arange(self.n)[cases]
        state = np.tile(self._start, (len(which), 1))
        if self.perturb is not None and len(which):
            q, v = self.rollout.split(state)
            state = self.rollout.state(*self.perturb(self._random, q.copy(), v.copy()))
            if state.shape != (len(which), self.rollout.nstate):
                raise ValueError(f"perturb returned states of shape {state.shape}, expected "
                                 f"({len(which)}, {self.rollout.nstate})")
        self.state[which], self.time[which], self.done[which] = state, 0.0, False
        distance, velocity, _ = self.relative(self.state)
        self._potential = self._potential_of(distance, velocity)
        return self._observe(self.state, distance, velocity), {}

    def step(self, action: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Advances by one period under actions (n, joints), clipped to -1 and 1. Returns observations (n, size), rewards,
        terminated, truncated (n,) and, in a dictionary, 'captured' and 'diverged' (n,), 'distance' (n, grasps) [m] and 'speed'
        (n, grasps) [m/s]."""
        if not self._is_reset:
            raise RuntimeError("step() before the first reset(): there is no initial state")
        action = np.asarray(action, dtype=float)
        if action.shape != (self.n, self.robot.nu):
            raise ValueError(f"action has shape {action.shape}, expected ({self.n}, {self.robot.nu})")
        if not np.all(np.isfinite(action)):
            raise ValueError("action has values that are nan or infinite")
        live = np.flatnonzero(~self.done)
        diverged = np.zeros(self.n, dtype=bool)
        if len(live):
            control = (np.clip(action[live], -1, 1) * self.effort_scale)[:, None, :]
            after = self.rollout(self.state[live], control, last_only=True, threads=self.threads)
            sound = self._sound(after)
            self.state[live[sound]] = after[sound]
            diverged[live[~sound]] = True
            self.time[live] += self.period
        distance, velocity, turn = self.relative(self.state)
        potential = self._potential_of(distance, velocity)
        ready = self._captured(distance, velocity, turn) & ~diverged
        moved = np.zeros(self.n, dtype=bool)
        moved[live] = True
        reward = np.where(moved, self._potential - potential + ready, 0.0)
        terminated = ready & moved | diverged
        truncated = moved & ~terminated & (self.time >= self.duration - 1e-9)
        self._potential, self.done = potential, self.done | terminated | truncated
        info = {"captured": ready, "diverged": diverged, "distance": np.linalg.norm(distance, axis=2),
                "speed": np.linalg.norm(velocity, axis=2)}
        return self._observe(self.state, distance, velocity), reward, terminated, truncated, info

    def close(self) -> None:
        """Does nothing; the environment holds no resources."""


class CaptureEnv(_gymnasium.Env if _gymnasium is not None else object):  # type: ignore[misc]
    """One capture as an environment: `VectorCaptureEnv` with one case, without the axis of cases."""

    metadata: dict[str, Any] = {"render_modes": []}
    render_mode = None

    def __init__(self, problem: Problem, **settings: Any) -> None:
        self.vector = VectorCaptureEnv(problem, 1, **settings)
        self.observation_space = self.vector.single_observation_space
        self.action_space = self.vector.single_action_space

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """The first observation, (size,), and an empty dictionary."""
        if _gymnasium is not None:
            super().reset(seed=seed)  # sets gymnasium's generator, which wrappers and checks use
        observation, info = self.vector.reset(seed, options)
        return observation[0], info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Observation (size,), reward, terminated, truncated, and 'captured', 'diverged', 'distance' and 'speed' of the grasps."""
        action = np.asarray(action, dtype=float)
        if action.shape != self.action_space.shape:
            raise ValueError(f"action has shape {action.shape}, expected {self.action_space.shape}")
        observation, reward, terminated, truncated, info = self.vector.step(action[None])
        return (observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]),
                {key: value[0] for key, value in info.items()})

    def close(self) -> None:
        """Does nothing; the environment holds no resources."""
