"""Captures as environments for reinforcement learning and search: reset and step, for one case or many.

The interface is that of gymnasium, which is optional. `grapnel.Rollout` computes the motion with fixed steps in SIMD lanes. When
all end-effectors are within their envelopes, the grasps close in a plastic impact, and momentum and energy are checked. Verify a
policy with `Problem.simulate`, which has error control, contacts, and the motion after the capture.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Union

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


#: A reward from the terms of a step (see VectorCaptureEnv): weights by their names, or a function of their arrays (n,).
Reward = Union[Mapping[str, float], Callable[[Mapping[str, Array]], Any]]

#: Names of the terms of rewards.
REWARD_TERMS = ("approach", "capture", "diverged", "time", "effort", "base_rate", "impulse")

#: Why a case has ended, by the numbers in `VectorCaptureEnv.end`; the first: it has not.
ENDS = ("", "captured", "diverged", "invalid action", "duration")

#: Largest relative change of momentum and relative increase of energy that the ledger accepts: in the approach, whose steps have
#: errors, and in the impact.
APPROACH_BOUND, IMPACT_BOUND = 1e-4, 1e-9

#: Speed above which a case of an environment has diverged [rad/s or m/s].
RUNAWAY = 1e5


def _quaternions_of(robot: Any) -> list[int]:
    """Indices in q at which the quaternions of free bodies begin."""
    names = robot.q_names
    return [i for i, name in enumerate(names[:-3]) if name.endswith("/qw") and names[i + 1] == name[:-1] + "x"]


class VectorCaptureEnv:
    """`n` simultaneous captures of one problem.

    Observation of a case: joint values [rad, m], joint rates, and the base's angular velocity [rad/s]. For each grasp follow the
    vector from the end-effector to its grasp point [m] and the relative velocity of the grasp point [m/s]. All are in the base's
    axes.

    Action: an effort per joint as a fraction of `effort_scale`, between -1 and 1, held for `period` [s]. Joints have the order of
    `env.robot.joints`. They are the joints of the arms, reaction wheels (`wheel:NAME`), gimbals and rotors of control moment gyros
    (`gyro:NAME`, `gyro-rotor:NAME`), and joints with springs. All of them accept efforts; send 0 for no effort.

    Names and units: `observation_names`, `observation_units`, `action_names`, `action_units`.

    Capture: every end-effector is within `position` [m], `velocity` [m/s] and `angular_velocity` [rad/s] of its grasp point. The
    defaults are those of its envelope, or 0.05 m and 0.05 m/s without an envelope. Angles of envelopes are not evaluated. All
    grasps then close in a plastic impact (`Robot.impact`), rigidly, at the end-effectors; the state is that after it. Entries
    of step()'s dictionary: 'impulse' (n, grasps, 6), [angular N m s; linear N s] in W on the robot, 'energy_loss' (n,) [J], and
    'ledger' (n,): 'yes' or 'no'. It states whether the grasps are at rest after the impact, its energy is that of the
    impulses, and momentum agrees. The bounds are those of this module; a smaller `step` reduces the error of the approach. 'momentum_drift' (n,)
    is the change of momentum about the centre of mass since the reset, relative to masses and moments at the largest kinetic
    energy; nan with gravity or a fixed or held base, since momentum changes then, and the ledger judges the impact alone. These
    entries are nan, or 'not checked', for cases without a capture in this step.

    Not computed: orbits, `external_wrenches`, contacts between shapes, and the motion after the capture.

    Reward of a step: `reward`, weights of these terms, or a function of a dictionary with all of them (n,):
    'approach', the decrease of sum(distance + 1 s * relative speed) over the grasps [m]; 'capture', 1 at the capture; 'diverged',
    -1 if the case diverges or its action is invalid; 'time', -`period` [s]; 'effort', minus the mean square of the clipped
    action times `period` [s]; 'base_rate', minus the base's angular speed times `period` [rad]; 'impulse', minus the sum of the
    linear impulses at the capture [N s]. The default is {'approach': 1, 'capture': 1}.

    End of a case: at the capture (terminated), at `duration` (truncated), or terminated when it diverges or its action has values
    that are not finite; 'reason' (n,) in the dictionary states it ('captured', 'duration', 'diverged', 'invalid action', or ''
    before the end), until the case is reset. A case diverges if a speed exceeds `RUNAWAY` (rad/s or m/s) or its state
    is not valid. It then keeps its last valid state. A case that has ended keeps its state, with rewards of 0, until it is reset.
    """

    def __init__(self, problem: Problem, n: int, period: float = 0.1, step: float = 0.02, duration: float | None = None,
                 effort_scale: Any = None, position: float | None = None, velocity: float | None = None,
                 angular_velocity: float | None = None, method: str = "rk4", perturb: Perturb | None = None,
                 threads: int = 0, reward: Reward | None = None) -> None:
        if not (0 < step <= period < math.inf):
            raise ValueError(f"step is {step}, period {period}; expected 0 < step <= period, both finite")
        if duration is not None and not 0 < duration < math.inf:
            raise ValueError(f"duration is {duration}; expected a positive and finite time")
        for name, tolerance in (("position", position), ("velocity", velocity), ("angular_velocity", angular_velocity)):
            if tolerance is not None and not tolerance >= 0:
                raise ValueError(f"{name} is {tolerance}; expected a tolerance that is not negative")
        n = whole_number("n", n, 1, 2**31)
        substeps = math.ceil(period / step - 1e-9)
        self.rollout = Rollout(problem, period / substeps, substeps, method)
        self.robot = self.rollout.robot
        self.n, self.period, self.threads, self.perturb = n, float(period), thread_count(threads), perturb
        self.duration = float(duration if duration is not None else self.robot._core.approach_duration or 20.0)
        self.grasps: list[dict[str, Any]] = self.robot._core.grasps
        if not self.grasps:
            raise ValueError("the problem has no grasps; an environment needs at least one grasp as its goal")
        self._tolerances = [self._tolerance(grasp, position, velocity, angular_velocity) for grasp in self.grasps]
        self.effort_scale = self._scale(effort_scale)
        self.reward = self._checked(reward)
        self._start = self.rollout.state(*self.robot.initial_state())
        self._quaternions = _quaternions_of(self.robot)
        # Nothing outside acts on robot and targets.
        self._conserves = not self.robot._core.is_base_held and not np.any(self.rollout._gravity) and any(
            name.startswith(f"{self.robot.base}/") for name in self.robot.v_names)
        self._mass = float(self._masses(np.atleast_2d(self.robot.initial_state()[0]))[0][0]) if self._conserves else math.nan
        self._random = np.random.default_rng()
        size = 2 * self.robot.nu + 3 + 6 * len(self.grasps)
        self.single_observation_space = _box(np.full(size, -np.inf), np.full(size, np.inf))
        self.single_action_space = _box(np.full(self.robot.nu, -1.0), np.full(self.robot.nu, 1.0))
        self.observation_space = _box(np.full((n, size), -np.inf), np.full((n, size), np.inf))
        self.action_space = _box(np.full((n, self.robot.nu), -1.0), np.full((n, self.robot.nu), 1.0))
        self.state = np.tile(self._start, (n, 1))  #: [q; v] of every case
        self.time = np.zeros(n)  #: time of every case [s]
        self.done = np.ones(n, dtype=bool)  #: cases that have ended, and all before the first reset
        self.end = np.zeros(n, dtype=int)  #: why a case has ended, an index into ENDS
        self._momentum = np.zeros((n, 6))  # about the centre of mass, at the reset
        self._energy = np.zeros(n)  # largest kinetic energy relative to the centre of mass since the reset [J]
        self._potential = np.zeros(n)
        self._is_reset = False

    @property
    def num_envs(self) -> int:
        """The number of cases n, with gymnasium's name."""
        return self.n

    @staticmethod
    def _checked(reward: Reward | None) -> Reward:
        if reward is None:
            return {"approach": 1.0, "capture": 1.0}
        if callable(reward):
            return reward
        if not isinstance(reward, Mapping):
            raise TypeError(f"reward is {reward!r}; expected weights by name, or a function")
        for name, weight in reward.items():
            if name not in REWARD_TERMS:
                raise ValueError(f"reward has the term {name!r}; expected some of {', '.join(REWARD_TERMS)}")
            if not isinstance(weight, (int, float, np.number)) or not math.isfinite(weight):
                raise ValueError(f"the weight of {name!r} is {weight!r}; expected a finite number")
        return dict(reward)

    @property
    def action_names(self) -> list[str]:
        """The joints, in the order of an action."""
        return list(self.robot.joints)

    @property
    def action_units(self) -> list[str]:
        """'1': actions are fractions of `effort_scale`."""
        return ["1"] * self.robot.nu

    @property
    def observation_names(self) -> list[str]:
        """The components of an observation: 'position/JOINT', 'velocity/JOINT', 'base/angular_velocity/x', 'distance/TIP/x', ..."""
        names = [f"{kind}/{joint}" for kind in ("position", "velocity") for joint in self.robot.joints]
        names += [f"base/angular_velocity/{axis}" for axis in "xyz"]
        for grasp in self.grasps:
            names += [f"{kind}/{grasp['end_effector']}/{axis}" for kind in ("distance", "velocity") for axis in "xyz"]
        return names

    @property
    def observation_units(self) -> list[str]:
        """Their units."""
        joints = self.robot._core.joint_units
        return [*joints, *(f"{unit}/s" for unit in joints), *["rad/s"] * 3, *(["m"] * 3 + ["m/s"] * 3) * len(self.grasps)]

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
        """For states (n, nstate): vectors from end-effectors to grasp points [m], in W. Then, relative to the end-effectors, the
        velocity of the grasp points [m/s] and the angular velocity of the targets [rad/s], in W. (n, grasps, 3) each."""
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

    def _perturbed(self, state: Array) -> Array:
        """The states that `perturb` makes of these. Raises ValueError unless they are as many valid states."""
        assert self.perturb is not None
        q, v = self.rollout.split(state)
        changed = self.perturb(self._random, q.copy(), v.copy())
        if not isinstance(changed, tuple) or len(changed) != 2:
            raise ValueError(f"perturb returned {type(changed).__name__}; expected the pair (q, v)")
        made = np.asarray(self.rollout.state(*changed))
        if made.shape != state.shape:
            raise ValueError(f"perturb returned states of shape {made.shape}, expected {state.shape}")
        if not np.all(self._sound(made)):
            raise ValueError(f"perturb returned an invalid state for case {int(np.argmin(self._sound(made)))} of those reset: not finite, "
                             "too fast, or a quaternion without unit norm")
        return made

    # ---- Capture ----

    def _masses(self, q: Array) -> tuple[Array, Array]:
        """Mass and sum of the moments of inertia of all free bodies, (n,) each."""
        M = self.robot.mass_matrix(q)
        names = self.robot.v_names
        mass = sum(M[:, i, i] for i, name in enumerate(names) if name.endswith("/vx"))
        moment = sum(M[:, i, i] + M[:, i + 1, i + 1] + M[:, i + 2, i + 2] for i, name in enumerate(names) if name.endswith("/wx"))
        return np.asarray(mass), np.asarray(moment)

    def _scales(self, q: Array, momentum: Array, energy: Array) -> Array:
        """Scales of momentum about the centre of mass, (n, 6): of masses and moments at the largest kinetic energy relative to the
        centre of mass since the reset, with a floor of 1e-6 of unit speeds and of rounding."""
        mass, moment = self._masses(q)
        speed = np.linalg.norm(momentum[:, 3:], axis=1) / mass
        linear = np.maximum(np.sqrt(2 * energy * mass), mass * (1e-6 + 1e-9 * speed))
        angular = np.maximum(np.sqrt(2 * energy * moment), moment * 1e-6)
        return np.stack([angular] * 3 + [linear] * 3, axis=1)

    def _note_energy(self, which: Array) -> None:
        """Largest kinetic energy relative to the centre of mass, of the cases `which`."""
        if not self._conserves or not len(which):
            return
        q, v = self.rollout.split(self.state[which])
        momentum = np.atleast_2d(self.robot.momentum(q, v))
        mass = self._mass
        own = np.atleast_1d(self.robot.kinetic_energy(q, v)) - np.sum(momentum[:, 3:]**2, axis=1) / (2 * mass)
        self._energy[which] = np.maximum(self._energy[which], own)

    def _contact_twists(self, q: Array, v: Array) -> Array:
        """Twists of the end-effectors relative to the targets at the end-effectors' origins, (n, grasps, 6), in W."""
        twists = []
        for grasp in self.grasps:
            V_WE = self.robot.frame_twist(grasp["end_effector"], q, v)
            V_WT = self.robot.frame_twist(grasp["target"], q, v)
            arm = self.robot.frame_pose(grasp["end_effector"], q)[:, :3, 3] - self.robot.frame_pose(grasp["target"], q)[:, :3, 3]
            at_tip = V_WT[:, 3:] + np.cross(V_WT[:, :3], arm)
            twists.append(np.concatenate([V_WE[:, :3] - V_WT[:, :3], V_WE[:, 3:] - at_tip], axis=1))
        return np.stack(twists, axis=1)

    def _close(self, which: Array, info: dict[str, Any]) -> None:
        """The impact of the cases `which`: state, impulses, and the ledger."""
        q, v = self.rollout.split(self.state[which])
        impact = self.robot.impact(q, v, [(grasp["end_effector"], grasp["target"]) for grasp in self.grasps])
        before, after = np.asarray(impact.kinetic_energy_before), np.asarray(impact.kinetic_energy_after)
        self.state[which] = self.rollout.state(q, impact.velocity)
        info["impulse"][which] = impact.impulse
        info["energy_loss"][which] = before - after
        # The grasps are at rest afterwards, and the loss is the work of the impulses on the twists before.
        twist, rest = self._contact_twists(q, v), self._contact_twists(q, impact.velocity)
        fast = np.linalg.norm(twist, axis=(1, 2)) + np.max(np.abs(v), axis=1)
        work = -0.5 * np.sum(impact.impulse * twist, axis=(1, 2))
        balanced = (np.asarray(impact.generalized_momentum_residual) <= IMPACT_BOUND) \
            & (np.linalg.norm(rest, axis=(1, 2)) <= IMPACT_BOUND * fast) \
            & (np.abs(before - after - work) <= IMPACT_BOUND * before)
        if self._conserves:
            old, new = self.robot.momentum(q, v), self.robot.momentum(q, impact.velocity)
            scale = self._scales(q, old, self._energy[which])
            drift = np.max(np.abs(old - self._momentum[which]) / scale, axis=1)
            jump = np.max(np.abs(new - old) / scale, axis=1)
            info["momentum_drift"][which] = drift
            balanced &= (drift <= APPROACH_BOUND) & (jump <= IMPACT_BOUND)
        info["ledger"][which] = np.where(balanced, "yes", "no")

    # ---- Environment ----

    def reset(self, seed: int | None = None, options: dict[str, Any] | None = None,
              cases: Array | None = None) -> tuple[Array, dict[str, Any]]:
        """Resets all cases, or those of `cases` (indices or booleans), to the problem's initial state, changed by `perturb`.
        Returns observations (n, size) and an empty dictionary."""
        if seed is not None:
            self._random = np.random.default_rng(seed)
        self._is_reset = True
        which = np.arange(self.n) if cases is None else np.atleast_1d(np.arange(self.n)[cases])
        state = np.tile(self._start, (len(which), 1))
        if self.perturb is not None and len(which):
            state = self._perturbed(state)
        self.state[which], self.time[which], self.done[which], self.end[which] = state, 0.0, False, 0
        if len(which):
            self._momentum[which] = self.robot.momentum(*self.rollout.split(state))
            self._energy[which] = 0.0
            self._note_energy(which)
        distance, velocity, _ = self.relative(self.state)
        self._potential = self._potential_of(distance, velocity)
        return self._observe(self.state, distance, velocity), {}

    def step(self, action: Array) -> tuple[Array, Array, Array, Array, dict[str, Any]]:
        """Advances by one period under actions (n, joints), clipped to -1 and 1. Returns observations (n, size), rewards,
        terminated, truncated (n,) and a dictionary. It has 'captured' and 'diverged' (n,), and 'distance' [m] and 'speed' [m/s]
        before an impact (n, grasps). The class documents its other entries. Only an action with a wrong shape raises an
        exception."""
        if not self._is_reset:
            raise RuntimeError("step() before the first reset(): there is no initial state")
        action = np.asarray(action, dtype=float)
        if action.shape != (self.n, self.robot.nu):
            raise ValueError(f"action has shape {action.shape}, expected ({self.n}, {self.robot.nu})")
        moved = ~self.done
        invalid = moved & ~np.all(np.isfinite(action), axis=1)
        action = np.clip(np.where(np.isfinite(action), action, 0), -1, 1)
        live = np.flatnonzero(moved & ~invalid)
        diverged = np.zeros(self.n, dtype=bool)
        if len(live):
            after = self.rollout(self.state[live], (action[live] * self.effort_scale)[:, None, :], last_only=True, threads=self.threads)
            sound = self._sound(after)
            self.state[live[sound]] = after[sound]
            diverged[live[~sound]] = True
            self.time[live] += self.period
            self._note_energy(live[sound])
        distance, velocity, turn = self.relative(self.state)
        captured = self._captured(distance, velocity, turn) & moved & ~diverged & ~invalid
        info: dict[str, Any] = {
            "captured": captured, "diverged": diverged, "distance": np.linalg.norm(distance, axis=2),
            "speed": np.linalg.norm(velocity, axis=2), "impulse": np.full((self.n, len(self.grasps), 6), np.nan),
            "energy_loss": np.full(self.n, np.nan), "momentum_drift": np.full(self.n, np.nan),
            "ledger": np.full(self.n, "not checked", dtype="<U11")}
        if np.any(captured):
            self._close(np.flatnonzero(captured), info)
        potential = self._potential_of(distance, velocity)
        observation = self._observe(self.state, *self.relative(self.state)[:2]) if np.any(captured) else \
            self._observe(self.state, distance, velocity)
        failed = diverged | invalid
        truncated = moved & ~captured & ~failed & (self.time >= self.duration - 1e-9)
        for cases, end in ((captured, 1), (diverged, 2), (invalid, 3), (truncated, 4)):
            self.end[cases] = end
        info["reason"] = np.array(ENDS)[self.end]
        rate = np.linalg.norm(observation[:, 2 * self.robot.nu:2 * self.robot.nu + 3], axis=1)
        reward = self._reward({
            "approach": self._potential - potential, "capture": captured.astype(float), "diverged": -failed.astype(float),
            "time": np.full(self.n, -self.period), "effort": -self.period * np.mean(action**2, axis=1), "base_rate": -self.period * rate,
            "impulse": -np.nan_to_num(np.linalg.norm(info["impulse"][:, :, 3:], axis=2)).sum(axis=1)}, moved)
        self._potential, self.done = potential, self.done | captured | failed | truncated
        return observation, reward, captured | failed, truncated, info

    def _reward(self, terms: dict[str, Array], moved: Array) -> Array:
        if callable(self.reward):
            reward = np.asarray(self.reward(terms), dtype=float)
            if reward.shape != (self.n,):
                raise ValueError(f"reward returned the shape {reward.shape}, expected ({self.n},)")
        else:
            reward = sum((weight * terms[name] for name, weight in self.reward.items()), np.zeros(self.n))
        return np.where(moved, reward, 0.0)

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
        self.observation_names, self.observation_units = self.vector.observation_names, self.vector.observation_units
        self.action_names, self.action_units = self.vector.action_names, self.vector.action_units

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Array, dict[str, Any]]:
        """The first observation, (size,), and an empty dictionary."""
        if _gymnasium is not None:
            super().reset(seed=seed)  # sets gymnasium's generator, which wrappers and checks use
        observation, info = self.vector.reset(seed, options)
        return observation[0], info

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Observation (size,), reward, terminated, truncated, and the entries of VectorCaptureEnv.step() for this case."""
        action = np.asarray(action, dtype=float)
        if action.shape != self.action_space.shape:
            raise ValueError(f"action has shape {action.shape}, expected {self.action_space.shape}")
        observation, reward, terminated, truncated, info = self.vector.step(action[None])
        return (observation[0], float(reward[0]), bool(terminated[0]), bool(truncated[0]),
                {key: str(value[0]) if value.dtype.kind == "U" else value[0] for key, value in info.items()})

    def close(self) -> None:
        """Does nothing; the environment holds no resources."""
