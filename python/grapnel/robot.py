"""Kinematics and dynamics of a robot with a floating base, for one state or many."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from . import _grapnel
from ._arguments import Array, Path, file_path, thread_count, whole_number
from .scenario import Problem

#: A closure or a grasp: two names, optionally 'rigid', 'hinge' or 'point', and the axis of a hinge.
Pair = Sequence[Any]


def _pairs(pairs: Iterable[Pair]) -> list[tuple[str, str, str, Any]]:
    result = []
    for pair in pairs:
        if isinstance(pair, str) or not 2 <= len(pair) <= 4:
            raise ValueError(f"{pair!r} is not a pair; expected (frame, frame), and optionally a kind and the axis of a hinge")
        result.append((str(pair[0]), str(pair[1]), str(pair[2]) if len(pair) > 2 else "rigid",
                       pair[3] if len(pair) > 3 else None))
    return result


def _gravity(gravity: Any) -> tuple[float, float, float]:
    array = np.asarray(gravity, dtype=float)
    if array.shape != (3,):
        raise ValueError(f"gravity has shape {array.shape}, expected (3,)")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"gravity is {gravity}; expected finite numbers")
    return float(array[0]), float(array[1]), float(array[2])


@dataclass(frozen=True)
class Impact:
    """Result of the simultaneous plastic impact of all grasps. For a batch, the first axis of all arrays is that of the batch."""

    velocity: Array  #: v after the impact, (nv,)
    impulse: Array  #: on the robot, [angular N m s; linear N s] in W at the contact point, (grasps, 6)
    contact_point: Array  #: in W [m], (grasps, 3)
    determined: Array  #: whether a component of an impulse is unique, (grasps, 6)
    kinetic_energy_before: Array  #: of all bodies [J]
    kinetic_energy_after: Array  #: [J]
    rank: Array  #: number of independent rows of the grasps
    generalized_momentum_residual: Array  #: |M (v+ - v-) - J^T P| relative to |M v-|, as a check


@dataclass(frozen=True)
class ForwardDynamicsDerivatives:
    """Derivatives of vdot = forward_dynamics(...), from Robot.forward_dynamics_derivatives. Rows: accelerations. For a batch, the
    first axis of all arrays is that of the batch."""

    vdot: Array  #: (nv,)
    dq: Array  #: with respect to a displacement in the order and the axes of v, (nv, nv)
    dv: Array  #: (nv, nv)
    dtau: Array  #: the inverse mass matrix, (nv, nv)
    dwrench: Array  #: with respect to [moment; force] in W at the origin of each of `frames`, (nv, 6 frames)


@dataclass(frozen=True)
class LoopDynamicsDerivatives(ForwardDynamicsDerivatives):
    """Derivatives of vdot, multipliers = Loops.forward_dynamics(...), from Loops.forward_dynamics_derivatives. For a batch, the
    first axis of all arrays is that of the batch."""

    multipliers: Array  #: (rows,)
    multipliers_dq: Array  #: (rows, nv)
    multipliers_dv: Array  #: (rows, nv)
    multipliers_dtau: Array  #: (rows, nv)
    multipliers_dwrench: Array  #: (rows, 6 frames)
    closing_dq: Array  #: smallest change of v, in kinetic energy, that satisfies the loops after a displacement, (nv, nv)
    rank: Array  #: number of independent rows; the multipliers of the others are zero
    contradiction: Array  #: inconsistency of redundant rows; if it is not small, vdot is not differentiable in this state


@dataclass(frozen=True)
class InverseDynamicsDerivatives:
    """Derivatives of tau = inverse_dynamics(...), from Robot.inverse_dynamics_derivatives. Rows: generalized forces. For a batch,
    the first axis of all arrays is that of the batch."""

    tau: Array  #: (nv,)
    dq: Array  #: with respect to a displacement in the order and the axes of v, (nv, nv)
    dv: Array  #: (nv, nv)
    dvdot: Array  #: the mass matrix, (nv, nv)


class Robot:
    """Model of a robot, alone or with the free targets of a problem, for custom computations.

    Sources: `Robot("robot.yaml")` or a model in URDF or MJCF, `Robot("ets-vii")` for a ready-made robot, `Robot(problem)`, or
    `Robot(problem, targets=True)`. In the last case the targets are the last coordinates, as bodies named 'target:NAME'. To choose
    options of the import of a model, use the key `import` of a scenario (docs/formats/import.md): `Robot(Scenario(...))`.

    A state consists of `q` (`nq` numbers) and `v` (`nv` numbers), in the order of `q_names` and `v_names`. A free body has its
    position p_WB in W [m] and quaternion_wxyz of R_WB in q, and the [angular; linear] velocity of its origin in its own axes
    [rad/s, m/s] in v. A joint has its angle or travel [rad, m] in q and its rate in v.

    Every function accepts one state, arrays (nq,) and (nv,), or a batch, (n, nq) and (n, nv), and returns one result, or n
    results along the first axis. Single arguments apply to every row of a batch. Kinematics and dynamics run in SIMD lanes, and
    batches on all processors, while other Python threads continue. Each row of a batch has the bits of a single call. Wrong
    shapes, numbers that are not finite, and quaternions without unit norm raise ValueError. A robot is immutable; a pickled robot
    is read again from its file.
    """

    def __init__(self, source: Path | Problem, targets: bool = False) -> None:
        if isinstance(source, Problem):
            self._source: Path | Problem = source.copy()
            self._core = _grapnel.Robot(source._core, bool(targets))
        elif targets:
            raise ValueError("a robot file has no targets; load the scenario and pass the problem")
        else:
            self._source = file_path("source", source)
            self._core = _grapnel.Robot(self._source)
        self._targets = bool(targets)
        self._held_at: Array | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        if self._held_at is not None:
            return _held_again, (self._source, self._held_at)
        return Robot, (self._source, self._targets)

    def holding(self, q: ArrayLike) -> Robot:
        """For `Robot(problem, targets=True)`: the robot with all grasps of the problem closed in the configuration `q`, (nq,).
        Targets are attached to the arms that grasp them. `q` and `v` of the result are those of the base and the joints (and of
        hinges and balls of grasps); frames 'target:NAME' remain. The first of several grasps of a target holds it."""
        held = Robot.__new__(Robot)
        held._source, held._targets, held._held_at = self._source, True, np.array(q, dtype=float)
        held._core = self._core.holding(q)
        return held

    # ---- Structure ----

    @property
    def name(self) -> str:
        """The robot's name."""
        return self._core.name

    @property
    def joints(self) -> list[str]:
        """Names of the movable joints, in the order of efforts and of `joint_q`, `joint_v`."""
        return self._core.joints

    @property
    def bodies(self) -> list[str]:
        """Names of the bodies, parents before children."""
        return self._core.bodies

    @property
    def frames(self) -> list[str]:
        """Names of the end-effectors (and of targets' frames)."""
        return self._core.frames

    @property
    def base(self) -> str:
        """Name of the base's body."""
        return self._core.base

    @property
    def nq(self) -> int:
        """Size of q: 7 per free body, one per joint."""
        return self._core.nq

    @property
    def nv(self) -> int:
        """Size of v: 6 per free body, one per joint."""
        return self._core.nv

    @property
    def nu(self) -> int:
        """Number of joints with efforts."""
        return self._core.nu

    @property
    def q_names(self) -> list[str]:
        """Names of the components of q: 'base/x', ..., 'base/qw', ..., then names of joints."""
        return self._core.q_names

    @property
    def v_names(self) -> list[str]:
        """Names of the components of v: 'base/wx', ..., 'base/vx', ..., then names of joints."""
        return self._core.v_names

    @property
    def joint_q(self) -> Array:
        """Indices of the joints' values in q: `q[..., robot.joint_q]`."""
        return np.array(self._core.joint_q, dtype=int)

    @property
    def joint_v(self) -> Array:
        """Indices of the joints' rates in v."""
        return np.array(self._core.joint_v, dtype=int)

    def body_q(self, body: str) -> slice | None:
        """Slice of q with a free body's position and quaternion; None for a body on a joint."""
        at = self._core.body_q(body)
        return None if at < 0 else slice(at, at + 7)

    def body_v(self, body: str) -> slice | None:
        """Slice of v with a free body's [angular; linear] velocity; None for a body on a joint."""
        at = self._core.body_v(body)
        return None if at < 0 else slice(at, at + 6)

    @property
    def lower(self) -> Array:
        """Minimum joint values [rad, m]; -inf without a limit."""
        return self._core.lower

    @property
    def upper(self) -> Array:
        """Maximum joint values [rad, m]; inf without a limit."""
        return self._core.upper

    @property
    def rate_limit(self) -> Array:
        """Maximum joint rates [rad/s, m/s]; inf without a limit."""
        return self._core.rate_limit

    @property
    def effort_limit(self) -> Array:
        """Maximum joint efforts [N m, N]; inf without a limit."""
        return self._core.effort_limit

    @property
    def mass(self) -> float:
        """Total mass [kg]."""
        return self._core.mass

    def zero_state(self) -> tuple[Array, Array]:
        """q and v with all free bodies at the origin of W, unrotated and at rest, and joints at zero."""
        q, v = self._core.zero_state()
        return q, v

    def initial_state(self) -> tuple[Array, Array]:
        """q and v at the start of the problem's run, targets included; for a robot file the zero state."""
        q, v = self._core.initial_state()
        return q, v

    def __repr__(self) -> str:
        return f"<grapnel.Robot {self.name!r}: {len(self.bodies)} bodies, {self.nu} joints, {self.mass:g} kg>"

    # ---- Kinematics ----

    def frame_pose(self, frame: str, q: ArrayLike) -> Array:
        """X_WE of a frame or a body, (4, 4): rotation R_WE and position p_WE [m] of its origin, in W."""
        return self._core.frame_pose(frame, q)

    def frame_twist(self, frame: str, q: ArrayLike, v: ArrayLike) -> Array:
        """V_WE, (6,): [angular; linear] velocity of a frame or a body at its origin, in W [rad/s, m/s]."""
        return self._core.frame_twist(frame, q, v)

    def forward_kinematics(self, q: ArrayLike) -> dict[str, Array]:
        """X_W of all bodies and end-effectors by name, (4, 4) each."""
        names = [*self.bodies, *(frame for frame in self.frames if frame not in self.bodies)]
        return {name: self._core.frame_pose(name, q) for name in names}

    def jacobian(self, frame: str, q: ArrayLike) -> Array:
        """J of a frame or a body at its origin, (6, nv): its twist [angular; linear] in W is J v (2.1)."""
        return self._core.jacobian(frame, q)

    def generalized_jacobian(self, frame: str, q: ArrayLike) -> Array:
        """J_g = J_m - J_b I_b^-1 I_bm of a frame on the robot, (6, joints): its twist in W per joint rate, with a floating
        base at zero momentum (2.5). For a fixed base, the ordinary Jacobian."""
        return self._core.generalized_jacobian(frame, q)

    # ---- Inertia and momentum ----

    def mass_matrix(self, q: ArrayLike) -> Array:
        """M of M vdot + bias = tau (2.7), (nv, nv), rotors included."""
        return self._core.mass_matrix(q)

    def base_inertia(self, q: ArrayLike) -> Array:
        """I_b, (6, 6): in B at B's origin; (0, 0) for a fixed base."""
        return self._core.base_inertia(q)

    def coupling_inertia(self, q: ArrayLike) -> Array:
        """I_bm, (6, joints): momentum in B at B's origin per joint rate."""
        return self._core.coupling_inertia(q)

    def generalized_inertia(self, q: ArrayLike) -> Array:
        """I_m - I_bm^T I_b^-1 I_bm, (joints, joints): the inertia of the joints with a floating base (2.8)."""
        return self._core.generalized_inertia(q)

    def center_of_mass(self, q: ArrayLike) -> Array:
        """Centre of mass of all bodies, in W [m], (3,)."""
        return self._core.center_of_mass(q)

    def momentum(self, q: ArrayLike, v: ArrayLike, about: ArrayLike | None = None) -> Array:
        """Total [angular; linear] momentum in W [N m s, N s], (6,), about a point in W, by default the centre of mass (2.2)."""
        return self._core.momentum(q, v, about)

    def kinetic_energy(self, q: ArrayLike, v: ArrayLike) -> Array:
        """Total kinetic energy, rotors included [J]."""
        return self._core.kinetic_energy(q, v)

    def base_twist(self, q: ArrayLike, joint_rates: ArrayLike, momentum: ArrayLike | None = None) -> Array:
        """V_WB of the floating base in W, (6,), for joint rates (joints,) and the robot's momentum [angular about its centre of
        mass; linear] in W, by default zero (2.6)."""
        return self._core.base_twist(q, joint_rates, momentum)

    # ---- Dynamics ----

    def bias(self, q: ArrayLike, v: ArrayLike, gravity: ArrayLike = (0, 0, 0)) -> Array:
        """c of M vdot + c = tau (2.7), (nv,): generalized forces at zero acceleration; `gravity`: uniform, in W [m/s^2]."""
        return self._core.bias(q, v, _gravity(gravity))

    def forward_dynamics(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike | None = None, gravity: ArrayLike = (0, 0, 0)) -> Array:
        """vdot, (nv,), without joint friction. `tau`: an effort per joint (nu,) [N m, N], or a generalized force per velocity (nv,);
        for a free body this is a wrench [moment; force] in its own axes at its origin. None: zero."""
        return self._core.forward_dynamics(q, v, tau, _gravity(gravity))

    def inverse_dynamics(self, q: ArrayLike, v: ArrayLike, vdot: ArrayLike, gravity: ArrayLike = (0, 0, 0)) -> Array:
        """tau, (nv,): the generalized forces for the accelerations vdot (nv,)."""
        return self._core.inverse_dynamics(q, v, vdot, _gravity(gravity))

    def forward_dynamics_derivatives(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike | None = None,
                                     gravity: ArrayLike = (0, 0, 0), frames: Iterable[str] = (),
                                     wrenches: ArrayLike | None = None, base_held: bool = False) -> ForwardDynamicsDerivatives:
        """Analytical derivatives of forward_dynamics() with respect to q, v and tau, (nv, nv) each, and to wrenches, (nv, 6 frames)
        (section 28 of docs/theory).

        Columns of `dq` belong to a displacement in the order and the axes of v: of a joint its position; of a free body a rotation
        vector and a displacement in its own axes [rad; m]. `frames`: names of frames or bodies at whose origins wrenches act;
        `wrenches`: their values [moment; force] in W, (frames, 6), for all cases, by default zero. A wrench keeps its components in W
        and its point of the body. `base_held`: the base has zero acceleration, and its rows are zero. Springs and friction of joints
        are not included: add `dtau @ dforce_dx`."""
        return ForwardDynamicsDerivatives(
            *self._core.forward_dynamics_derivatives(q, v, tau, _gravity(gravity), list(frames), wrenches, bool(base_held)))

    def inverse_dynamics_derivatives(self, q: ArrayLike, v: ArrayLike, vdot: ArrayLike, gravity: ArrayLike = (0, 0, 0),
                                     frames: Iterable[str] = (), wrenches: ArrayLike | None = None) -> InverseDynamicsDerivatives:
        """Analytical derivatives of inverse_dynamics() with respect to q, v and vdot, (nv, nv) each, with the arguments of
        forward_dynamics_derivatives()."""
        return InverseDynamicsDerivatives(
            *self._core.inverse_dynamics_derivatives(q, v, vdot, _gravity(gravity), list(frames), wrenches))

    # ---- Constraints ----

    def loops(self, closures: Iterable[Pair], closed_at: ArrayLike | None = None) -> Loops:
        """Closed loops: pairs of frames or bodies that are joined, `[("tip-1", "tip-2")]`, rigidly, or by a 'hinge' or 'point' as
        the third item. With `closed_at`, a q, the loop is closed in this configuration: the second frame of each pair is moved to
        the first one there."""
        return Loops(self, closures, closed_at)

    def impact(self, q: ArrayLike, v: ArrayLike, grasps: Iterable[Pair], joints: str = "free") -> Impact:
        """The plastic impact when end-effectors grasp bodies simultaneously: `[("tip-1", "target:debris")]`, rigidly, or by a
        'hinge' or 'point' as the third item (with the hinge's axis in the end-effector's frame as the fourth). Contact is at the
        end-effectors' origins. `joints`: 'free', or 'braked' to rest in the same instant. Exact for any momentum and any number of
        arms (section 7 of docs/theory); redundant impulses minimize (7.8)."""
        if joints not in ("free", "braked"):
            raise ValueError(f"joints is {joints!r}; expected 'free' or 'braked'")
        return Impact(**self._core.impact(q, v, _pairs(grasps), joints == "braked"))


def _held_again(source: Problem, q: Array) -> Robot:
    return Robot(source, targets=True).holding(q)


class Loops:
    """Closed loops of a robot, see Robot.loops. Thread safety: immutable."""

    def __init__(self, robot: Robot, closures: Iterable[Pair], closed_at: ArrayLike | None = None) -> None:
        self.robot = robot
        self._pairs = _pairs(closures)
        self._closed_at = None if closed_at is None else np.array(closed_at, dtype=float)
        self._core = _grapnel.Loops(robot._core, self._pairs, self._closed_at)

    def __reduce__(self) -> tuple[Any, ...]:
        return Loops, (self.robot, self._pairs, self._closed_at)

    @property
    def rows(self) -> int:
        """Number of rows of all closures: 6 for a rigid one, 5 for a hinge, 3 for a point; then one for each coupling of the
        robot's joints."""
        return self._core.rows

    def defect(self, q: ArrayLike, v: ArrayLike | None = None) -> Array:
        """Closure errors, (closures, 4): distance [m], angle [rad], velocity [m/s], angular velocity [rad/s], in the constrained
        directions."""
        return self._core.defect(q, v)

    def forward_dynamics(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike | None = None,
                         gravity: ArrayLike = (0, 0, 0)) -> tuple[Array, Array]:
        """vdot (nv,) with closed loops, and the multipliers of the closures (rows,): [moment; force] rows in the first frame's axes
        on the first body [N m, N]; redundant multipliers are not unique (2.9)-(2.12). `tau` as in Robot.forward_dynamics."""
        vdot, multipliers = self._core.forward_dynamics(q, v, tau, _gravity(gravity))
        return vdot, multipliers

    def forward_dynamics_derivatives(self, q: ArrayLike, v: ArrayLike, tau: ArrayLike | None = None,
                                     gravity: ArrayLike = (0, 0, 0), frames: Iterable[str] = (),
                                     wrenches: ArrayLike | None = None, base_held: bool = False) -> LoopDynamicsDerivatives:
        """Analytical derivatives of forward_dynamics(), accelerations (nv, nv) and multipliers (rows, nv), with the
        arguments of Robot.forward_dynamics_derivatives (section 28 of docs/theory). Displacements are those without loops; for
        states that satisfy the loops, combine columns: directions x of q with J x = 0, and for each the velocities
        `closing_dq @ x`."""
        *arrays, rank, contradiction = self._core.forward_dynamics_derivatives(
            q, v, tau, _gravity(gravity), list(frames), wrenches, bool(base_held))
        values = [*arrays, rank[..., 0].astype(int), contradiction[..., 0]]
        return LoopDynamicsDerivatives(*values)

    def close_velocities(self, q: ArrayLike, v: ArrayLike) -> Array:
        """The velocity nearest in kinetic energy that satisfies the loops, (nv,): the result of a plastic impact of all closures."""
        return self._core.close_velocities(q, v)

    def project(self, q: ArrayLike, v: ArrayLike | None = None) -> tuple[Array, Array, Array]:
        """q (nq,) and v (nv,) projected onto the closures in the mass metric, and whether the iteration converged (1 or 0). It finds
        a nearby closed configuration only."""
        closed_q, closed_v, converged = self._core.project(q, v)
        return closed_q, closed_v, converged


class Rollout:
    """Motions of one robot from many states with given joint efforts, with the interface of MuJoCo's `rollout`.

    Integration uses a fixed step, 'rk4' (order 4) or semi-implicit 'euler', without error control; use `Problem.simulate` for
    captures with ten accurate digits. Cases run in SIMD lanes on all processors, and the numbers of a case depend on that case
    alone. Efforts are saturated at the joints' effort limits. Joints have the friction of the robot file unless `friction` is False.

    `source`: a problem, with its free targets and its gravity, or a Robot. `step`: in s; each control acts for `substeps` steps. A
    base that the problem holds during the approach is held.
    """

    def __init__(self, source: Problem | Robot, step: float, substeps: int = 1, method: str = "rk4",
                 gravity: ArrayLike | None = None, friction: bool = True) -> None:
        if isinstance(source, Problem):
            source = Robot(source, targets=True)
        if not isinstance(source, Robot):
            raise TypeError(f"{source!r} is neither a grapnel.Problem nor a grapnel.Robot")
        if not isinstance(method, str):
            raise TypeError(f"method is {method!r}; expected 'rk4' or 'euler'")
        self.robot = source
        self.step, self.substeps, self.method = float(step), whole_number("substeps", substeps, 1, 10**9), method
        self._gravity = _gravity(source._core.gravity if gravity is None else gravity)
        self._friction = bool(friction)
        self._core = _grapnel.Rollout(source._core, self.step, self.substeps, method, self._gravity, self._friction,
                                      source._core.is_base_held)

    def __reduce__(self) -> tuple[Any, ...]:
        return Rollout, (self.robot, self.step, self.substeps, self.method, self._gravity, self._friction)

    @property
    def nstate(self) -> int:
        """Size of a state: nq + nv, q first."""
        return self.robot.nq + self.robot.nv

    def __call__(self, initial_state: ArrayLike, control: ArrayLike | None = None, steps: int | None = None, last_only: bool = False,
                 threads: int = 0) -> Array:
        """Computes the motions. `initial_state`: (n, nstate). `control`: (n, steps, nu) [N m, N], each constant for `substeps`
        steps; None: zero, for `steps` steps. Returns the states after each control, (n, steps, nstate), or with `last_only` after
        the last control, (n, nstate).

        One state (nstate,) applies to the controls of every case. With one course of controls (steps, nu) it gives one motion,
        (steps, nstate). Cases that overflow continue as nan. `threads`: 0 for one per processor. Ctrl-C ends it."""
        threads = thread_count(threads)
        if control is None and steps is None:
            raise ValueError("neither control nor steps is given; expected one of them")
        count = 0 if steps is None else whole_number("steps", steps, 1, 2**53)
        states = np.asarray(initial_state)
        controls = None if control is None else np.asarray(control)
        if controls is not None and steps is not None and controls.ndim > 1 and controls.shape[-2] != count:
            raise ValueError(f"steps is {count}, but control has shape {controls.shape}; give one of them, or the same number of steps")
        is_alone = states.ndim == 1 and (controls is None or controls.ndim == 2)
        if is_alone:
            states, controls = states[None], None if controls is None else controls[None]
        elif states.ndim == 1 and controls is not None and controls.ndim == 3:
            states = np.tile(states, (controls.shape[0], 1))
        after = self._core.run(states, controls, count, bool(last_only), threads)
        return np.asarray(after[0]) if is_alone else after

    def state(self, q: ArrayLike, v: ArrayLike) -> Array:
        """[q; v] of one state (nstate,) or many (n, nstate). A single q or v applies to all rows of the other."""
        q, v = np.asarray(q, dtype=float), np.asarray(v, dtype=float)
        for name, array, width in (("q", q, self.robot.nq), ("v", v, self.robot.nv)):
            if array.ndim == 0 or array.shape[-1] != width:
                raise ValueError(f"{name} has shape {array.shape}, expected ({width},), or (n, {width}) for n cases")
        cases = np.broadcast_shapes(q.shape[:-1], v.shape[:-1])
        return np.concatenate([np.broadcast_to(x, (*cases, x.shape[-1])) for x in (q, v)], axis=-1)

    def split(self, state: ArrayLike) -> tuple[Array, Array]:
        """q and v of states (views)."""
        state = np.asarray(state)
        if state.ndim == 0 or state.shape[-1] != self.nstate:
            raise ValueError(f"state has shape {state.shape}, expected (..., {self.nstate})")
        return state[..., : self.robot.nq], state[..., self.robot.nq:]


def rollout(source: Problem | Robot, initial_state: ArrayLike, control: ArrayLike | None = None, *, step: float,
            steps: int | None = None,
            substeps: int = 1, method: str = "rk4", gravity: ArrayLike | None = None, friction: bool = True,
            last_only: bool = False, threads: int = 0) -> Array:
    """`Rollout(...)(...)` in one call: initial_state (n, nstate), control (n, steps, nu) [N m, N] -> states (n, steps,
    nstate), each [q; v]."""
    return Rollout(source, step, substeps, method, gravity, friction)(initial_state, control, steps, last_only, threads)
