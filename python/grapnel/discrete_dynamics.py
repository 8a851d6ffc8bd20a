"""Motion of a robot from one sample to the next, with exact derivatives on the manifold of its states."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ._arguments import Array, whole_number
from .robot import Robot, _gravity
from .scenario import Problem

_SERIES_BELOW = 0.25  # theta^2 [rad^2] below which the coefficients of rotations are series
_CASES = 32  # of a batch whose derivatives are computed together, so that they stay in the cache
_LARGEST_ROTATION = 3.0  # of a body in one step [rad]; at 2 pi the coordinates of a step are singular


def _hat(w: Array) -> Array:
    """[w x], (..., 3, 3)."""
    result = np.zeros((*w.shape, 3))
    result[..., 2, 1], result[..., 0, 2], result[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    return result - np.swapaxes(result, -1, -2)


def _polynomial(s: Array, coefficients: Iterable[float]) -> Array:
    result = np.zeros_like(s)
    for one in reversed(list(coefficients)):
        result = result * s + one
    return result


class _Rotation:
    """Rotation vectors phi, (..., 3), with R = exp([phi x]) and the right Jacobian J_r: (d/dt) phi = J_r(phi)^-1 omega for
    the angular velocity omega in the axes of the body (Chirikjian 2012, section 10.8)."""

    def __init__(self, phi: Array) -> None:
        self.phi, self.hat = phi, _hat(phi)
        self.s = np.sum(phi * phi, axis=-1)
        small = self.s < _SERIES_BELOW
        s = np.where(small, 1.0, self.s)
        theta = np.sqrt(s)
        sine, cosine = np.sin(theta), np.cos(theta)
        t = np.where(small, self.s, 0.0)
        self.a = np.where(small, _polynomial(t, (1, -1 / 6, 1 / 120, -1 / 5040, 1 / 362880, -1 / 39916800)), sine / theta)
        self.b = np.where(small, _polynomial(t, (1 / 2, -1 / 24, 1 / 720, -1 / 40320, 1 / 3628800, -1 / 479001600)), (1 - cosine) / s)
        self.c = np.where(small, _polynomial(t, (1 / 6, -1 / 120, 1 / 5040, -1 / 362880, 1 / 39916800, -1 / 6227020800)),
                          (1 - sine / theta) / s)
        # J_r^-1 = 1 + [phi x] / 2 + e [phi x]^2 and its derivative de/ds, s = theta^2.
        e = (1 - self.a / (2 * self.b)) / s
        da, db = (cosine - self.a) / (2 * s), (self.a / 2 - self.b) / s
        de = (-(da * self.b - self.a * db) / (2 * self.b**2) - e) / s
        bernoulli = (1 / 12, 1 / 720, 1 / 30240, 1 / 1209600, 1 / 47900160, 691 / 1307674368000, 1 / 74724249600)
        self.e = np.where(small, _polynomial(t, bernoulli), e)
        self.de = np.where(small, _polynomial(t, [k * one for k, one in enumerate(bernoulli)][1:]), de)

    def _matrix(self, first: Any, second: Array) -> Array:
        return np.eye(3) + np.asarray(first)[..., None, None] * self.hat + second[..., None, None] * (self.hat @ self.hat)

    @property
    def R(self) -> Array:
        """exp([phi x])."""
        return self._matrix(self.a, self.b)

    @property
    def quaternion(self) -> Array:
        """(w, x, y, z)."""
        half = _Rotation(self.phi / 2)
        return np.concatenate([np.cos(np.sqrt(self.s) / 2)[..., None], half.a[..., None] * half.phi], axis=-1)

    @property
    def J(self) -> Array:
        """J_r."""
        return self._matrix(-self.b, self.c)

    @property
    def J_inverse(self) -> Array:
        """J_r^-1."""
        return self._matrix(np.full_like(self.s, 0.5), self.e)

    def J_inverse_derivative(self, omega: Array) -> Array:
        """d/dphi (J_r(phi)^-1 omega), (..., 3, 3)."""
        phi = self.phi
        along = np.sum(phi * omega, axis=-1)[..., None, None]
        double = phi * along[..., 0] - omega * self.s[..., None]  # phi x (phi x omega)
        outer = phi[..., :, None] * omega[..., None, :]
        return np.asarray(-0.5 * _hat(omega) + 2 * self.de[..., None, None] * double[..., :, None] * phi[..., None, :]
                          + self.e[..., None, None] * (along * np.eye(3) + outer - 2 * np.swapaxes(outer, -1, -2)))


def _product(p: Array, q: Array) -> Array:
    """Product of quaternions (w, x, y, z)."""
    w = p[..., :1] * q[..., :1] - np.sum(p[..., 1:] * q[..., 1:], axis=-1, keepdims=True)
    xyz = p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + np.cross(p[..., 1:], q[..., 1:])
    return np.concatenate([w, xyz], axis=-1)


def _matrix_of(q: Array) -> Array:
    """R of a unit quaternion (w, x, y, z)."""
    hat = _hat(q[..., 1:])
    return np.asarray(np.eye(3) + 2 * q[..., :1, None] * hat + 2 * hat @ hat)


def _logarithm(q: Array) -> Array:
    """The rotation vector of a quaternion, of at most pi."""
    q = np.where(q[..., :1] < 0, -q, q)
    sine = np.linalg.norm(q[..., 1:], axis=-1, keepdims=True)
    half = np.arctan2(sine, q[..., :1])
    return np.asarray(q[..., 1:] * np.where(sine < 1e-9, 2.0, 2 * half / np.where(sine < 1e-9, 1.0, sine)))


class DiscreteDynamics:
    """x+ = f(x, u) of a robot under inputs that are constant during a step, with exact derivatives A and B.

    A state x is [q; v], (nx,) = (nq + nv,), with q and v of `robot`: W, SI units, quaternion_wxyz. Deviations dx, (ndx,), are
    [displacement; change of v] in the order and the axes of v (28.1): joints by their positions; a free body by the rotation
    vector phi and the displacement d in its own axes, R = R_0 exp([phi x]), p = p_0 + R_0 d. A and B refer to deviations, so
    quaternions need no extra treatment: f(x + dx, u + du) = f(x, u) + (A dx + B du) with `plus` and `minus` for + and -.

    `source`: a Robot, or a Problem, whose robot, free targets, wheels (joints 'wheel:NAME') and gravity are used;
    `Robot(problem, targets=True).holding(q)` is the stack after a capture. `step`: in s, computed by `substeps` steps of the
    classic Runge-Kutta method of order 4 in the coordinates of the first one (Munthe-Kaas 1998). `inputs`: names of components
    of v whose generalized forces are inputs, also 'base_torque' and 'base_force', three numbers each in the axes of B [N m, N];
    by default all joints without lock. `locked`: joints that keep their positions: their rates must be zero and they are not
    part of dx. `damping`: of each joint (joints,), a force -damping * rate [N m s/rad, N s/m]. Joint friction of the
    robot file, limits and contacts are not part of f.

    All functions accept one state or a batch, (n, nx), and the derivatives of a batch are computed in SIMD lanes on all
    processors. Wrong shapes raise ValueError. f, `derivatives` and `rollout` also raise it for numbers that are not finite, for
    quaternions whose norm differs from 1 by more than 1e-6, for rates of locked joints, and for a body that turns by more than
    3 rad in a substep; `plus`, `minus`, `minus_jacobian` and `tangent` do not check these. Immutable.
    """

    def __init__(self, source: Robot | Problem, step: float, substeps: int = 1, inputs: Iterable[str] | None = None,
                 locked: Iterable[str] = (), gravity: ArrayLike | None = None, damping: ArrayLike | None = None) -> None:
        if isinstance(source, Problem):
            source = Robot(source, targets=True)
        if not isinstance(source, Robot):
            raise TypeError(f"{source!r} is neither a grapnel.Problem nor a grapnel.Robot")
        if not (np.isfinite(step) and step > 0):
            raise ValueError(f"step is {step}; expected a positive time in s")
        self.robot, self.step, self.substeps = source, float(step), whole_number("substeps", substeps, 1, 10**6)
        self._gravity = _gravity(source._core.gravity if gravity is None else gravity)
        self._bodies: list[tuple[slice, slice]] = []  # of free bodies, in q and v
        for body in source.bodies:
            at, to = source.body_q(body), source.body_v(body)
            if at is not None and to is not None:
                self._bodies.append((at, to))
        self._joint_q, self._joint_v = source.joint_q, source.joint_v
        if 7 * len(self._bodies) + len(self._joint_q) != source.nq:
            raise ValueError(f"{source.name} has spherical joints; expected free bodies and joints with one coordinate")
        names, joints = list(source.v_names), list(source.joints)
        locked = list(locked)
        for name in locked:
            if name not in joints:
                raise ValueError(f"no joint is named {name!r}; the joints are {', '.join(joints)}")
        self._locked = np.array([names.index(name) for name in locked], dtype=int)
        self._free = np.array([i for i in range(source.nv) if i not in set(self._locked)], dtype=int)
        self.inputs = self._input_names([name for name in joints if name not in locked] if inputs is None else list(inputs))
        self._force = np.zeros((source.nv, len(self.inputs)))
        for k, name in enumerate(self.inputs):
            if name not in names:
                raise ValueError(f"no component of v is named {name!r}; expected 'base_torque', 'base_force', or one of {', '.join(names)}")
            self._force[names.index(name), k] = 1
        self._damping = np.zeros(source.nv)
        if damping is not None:
            given = np.asarray(damping, dtype=float)
            if given.shape != (len(joints),) or not np.all(given >= 0):
                raise ValueError(f"damping has shape {given.shape}; expected ({len(joints)},), and no negative numbers")
            self._damping[self._joint_v] = given

    def _input_names(self, given: list[str]) -> list[str]:
        result: list[str] = []
        for name in given:
            axes = {"base_torque": "w", "base_force": "v"}.get(name)
            result += [name] if axes is None else [f"{self.robot.base}/{axes}{axis}" for axis in "xyz"]
        if len(set(result)) != len(result):
            raise ValueError(f"inputs has a name twice: {', '.join(result)}")
        return result

    # ---- Structure ----

    @property
    def nx(self) -> int:
        """Size of a state [q; v]."""
        return self.robot.nq + self.robot.nv

    @property
    def ndx(self) -> int:
        """Size of a deviation: twice the number of velocities without locked joints."""
        return 2 * len(self._free)

    @property
    def nu(self) -> int:
        """Number of inputs."""
        return len(self.inputs)

    @property
    def dx_names(self) -> list[str]:
        """Names of the components of a deviation: those of v, twice, with 'displacement:' before the first ones."""
        names = [self.robot.v_names[i] for i in self._free]
        return [*(f"displacement:{name}" for name in names), *names]

    @property
    def lower(self) -> Array:
        """Minimum inputs, (nu,): the effort limits of joints [N m, N], otherwise -inf."""
        return -self.upper

    @property
    def upper(self) -> Array:
        """Maximum inputs, (nu,)."""
        limits = dict(zip(self.robot.joints, self.robot.effort_limit))
        return np.array([limits.get(name, np.inf) for name in self.inputs])

    def state(self, q: ArrayLike, v: ArrayLike) -> Array:
        """x = [q; v], (nx,) or (n, nx)."""
        return np.concatenate([np.asarray(q, dtype=float), np.asarray(v, dtype=float)], axis=-1)

    def split(self, x: ArrayLike) -> tuple[Array, Array]:
        """q, (..., nq), and v, (..., nv), of states (views)."""
        x = np.asarray(x, dtype=float)
        if x.ndim == 0 or x.shape[-1] != self.nx:
            raise ValueError(f"x has shape {x.shape}, expected (..., {self.nx})")
        return x[..., : self.robot.nq], x[..., self.robot.nq:]

    # ---- The manifold ----

    def plus(self, x: ArrayLike, dx: ArrayLike) -> Array:
        """The state with the deviation dx, (..., ndx), from x, (..., nx)."""
        q, v = self.split(x)
        xi, dv = self._full(dx)
        cases = np.broadcast_shapes(q.shape[:-1], xi.shape[:-1])
        q = np.broadcast_to(q, (*cases, q.shape[-1]))
        return np.concatenate([self._moved(q, np.broadcast_to(xi, (*cases, xi.shape[-1]))), v + dv], axis=-1)

    def minus(self, x: ArrayLike, reference: ArrayLike) -> Array:
        """The deviation of x from a reference, (..., ndx): plus(reference, minus(x, reference)) = x. Rotations are at most pi."""
        (q, v), (q0, v0) = self.split(x), self.split(reference)
        cases = np.broadcast_shapes(q.shape[:-1], q0.shape[:-1])
        xi = np.zeros((*cases, self.robot.nv))
        xi[..., self._joint_v] = q[..., self._joint_q] - q0[..., self._joint_q]
        for at, to in self._bodies:
            now, then = q[..., at], q0[..., at]
            conjugate = then[..., 3:] * np.array([1, -1, -1, -1])
            xi[..., to] = np.concatenate([_logarithm(_product(conjugate, now[..., 3:])),
                                          np.einsum("...ji,...j->...i", _matrix_of(then[..., 3:]), now[..., :3] - then[..., :3])], axis=-1)
        dv = np.broadcast_to(v - v0, xi.shape)
        return np.concatenate([xi[..., self._free], dv[..., self._free]], axis=-1)

    def minus_jacobian(self, x: ArrayLike, reference: ArrayLike) -> Array:
        """Derivative of minus(x, reference) with respect to a deviation of x, (..., ndx, ndx)."""
        dx = self.minus(x, reference)
        xi, _ = self._full(dx)
        nv = self.robot.nv
        result = np.zeros((*xi.shape[:-1], 2 * nv, 2 * nv))
        result[..., range(2 * nv), range(2 * nv)] = 1
        for _, to in self._bodies:
            rotation = _Rotation(xi[..., to][..., :3])
            at = to.start
            result[..., at:at + 3, at:at + 3] = rotation.J_inverse
            result[..., at + 3:at + 6, at + 3:at + 6] = rotation.R
        both = np.concatenate([self._free, nv + self._free])
        return result[..., both[:, None], both]

    def tangent(self, x: ArrayLike) -> Array:
        """E(x), (..., nx, ndx): plus(x, dx) = x + E dx to first order. With its pseudoinverse, E(f) A E(x)^+ is the Jacobian of f
        with respect to the numbers of x, for tools that know no manifolds."""
        q, v = self.split(x)
        nq, nv = self.robot.nq, self.robot.nv
        result = np.zeros((*q.shape[:-1], nq + nv, 2 * nv))
        result[..., self._joint_q, self._joint_v] = 1
        for at, to in self._bodies:
            i, j = at.start, to.start
            quaternion = q[..., at][..., 3:]
            result[..., i:i + 3, j + 3:j + 6] = _matrix_of(quaternion)
            result[..., i + 3, j:j + 3] = -0.5 * quaternion[..., 1:]
            result[..., i + 4:i + 7, j:j + 3] = 0.5 * (quaternion[..., :1, None] * np.eye(3) + _hat(quaternion[..., 1:]))
        result[..., nq + np.arange(nv), nv + np.arange(nv)] = 1
        return result[..., np.concatenate([self._free, nv + self._free])]

    def _full(self, dx: ArrayLike) -> tuple[Array, Array]:
        """Displacements and changes of v of all velocities."""
        dx = np.asarray(dx, dtype=float)
        if dx.ndim == 0 or dx.shape[-1] != self.ndx:
            raise ValueError(f"dx has shape {dx.shape}, expected (..., {self.ndx})")
        result = np.zeros((2, *dx.shape[:-1], self.robot.nv))
        result[0][..., self._free], result[1][..., self._free] = np.split(dx, 2, axis=-1)
        return result[0], result[1]

    def _moved(self, q: Array, xi: Array) -> Array:
        result = np.array(q, dtype=float)
        result[..., self._joint_q] += xi[..., self._joint_v]
        for at, to in self._bodies:
            pose, by = q[..., at], xi[..., to]
            result[..., at.start:at.start + 3] += np.einsum("...ij,...j->...i", _matrix_of(pose[..., 3:]), by[..., 3:])
            turned = _product(pose[..., 3:], _Rotation(by[..., :3]).quaternion)
            result[..., at.start + 3:at.stop] = turned / np.linalg.norm(turned, axis=-1, keepdims=True)
        return result

    # ---- Accelerations ----

    def _acceleration(self, q: Array, v: Array, u: Array) -> Array:
        tau = u @ self._force.T - self._damping * v
        if not len(self._locked):
            return self.robot.forward_dynamics(q, v, tau, gravity=self._gravity)
        M, c = self.robot.mass_matrix(q), self.robot.bias(q, v, gravity=self._gravity)
        free, vdot = self._free, np.zeros_like(v)
        vdot[:, free] = np.linalg.solve(M[:, free[:, None], free], (tau - c)[:, free, None])[..., 0]
        return vdot

    def _acceleration_derivatives(self, q: Array, v: Array, u: Array) -> tuple[Array, Array, Array, Array]:
        """vdot, and its derivatives by displacements (n, nv, nv), by v (n, nv, nv) and by u (n, nv, nu)."""
        tau = u @ self._force.T - self._damping * v
        if not len(self._locked):
            d = self.robot.forward_dynamics_derivatives(q, v, tau, gravity=self._gravity)
            return d.vdot, d.dq, d.dv - d.dtau * self._damping, d.dtau @ self._force
        # (28.12) with rows and columns of the free velocities: M_ff d(vdot_f) = S du - d(ID).
        vdot = self._acceleration(q, v, u)
        inverse = self.robot.inverse_dynamics_derivatives(q, v, vdot, gravity=self._gravity)
        free, n, nv = self._free, len(q), self.robot.nv
        by_force = np.broadcast_to(self._force, (n, nv, self.nu))
        right = np.concatenate([-inverse.dq, -inverse.dv - np.diag(self._damping), by_force], axis=2)[:, free]
        solved = np.zeros((n, nv, 2 * nv + self.nu))
        solved[:, free] = np.linalg.solve(inverse.dvdot[:, free[:, None], free], right)
        return vdot, solved[:, :, :nv], solved[:, :, nv:2 * nv], solved[:, :, 2 * nv:]

    # ---- One step ----

    def _rotations(self, xi: Array) -> list[_Rotation]:
        result = [_Rotation(xi[:, to][:, :3]) for _, to in self._bodies]
        for one in result:
            if np.any(one.s > _LARGEST_ROTATION**2):
                raise ValueError(f"a body turns by {np.sqrt(one.s.max()):.3g} rad in {self.step / self.substeps:g} s; expected at most "
                                 f"{_LARGEST_ROTATION:g} rad: choose more substeps")
        return result

    def _coordinate_rates(self, v: Array, rotations: list[_Rotation]) -> Array:
        """d(xi)/dt: J_r^-1 omega and exp([phi x]) u for free bodies."""
        result = v.copy()
        for (_, to), rotation in zip(self._bodies, rotations):
            j = to.start
            result[:, j:j + 3] = np.einsum("nij,nj->ni", rotation.J_inverse, v[:, j:j + 3])
            result[:, j + 3:j + 6] = np.einsum("nij,nj->ni", rotation.R, v[:, j + 3:j + 6])
        return result

    def _coordinate_rate_derivatives(self, v: Array, rotations: list[_Rotation], Zxi: Array, Zv: Array) -> Array:
        result = Zv.copy()
        for (_, to), rotation in zip(self._bodies, rotations):
            a, b = slice(to.start, to.start + 3), slice(to.start + 3, to.start + 6)
            R = rotation.R
            result[:, a] = rotation.J_inverse_derivative(v[:, a]) @ Zxi[:, a] + rotation.J_inverse @ Zv[:, a]
            result[:, b] = R @ Zv[:, b] - R @ _hat(v[:, b]) @ rotation.J @ Zxi[:, a]
        return result

    def _displacements(self, xi: Array, rotations: list[_Rotation], Z0: Array, Zxi: Array) -> Array:
        """Displacement of q + xi in its own axes, by a displacement Z0 of q and a change Zxi of xi."""
        result = Z0 + Zxi
        for (_, to), rotation in zip(self._bodies, rotations):
            a, b = slice(to.start, to.start + 3), slice(to.start + 3, to.start + 6)
            back = np.swapaxes(rotation.R, 1, 2)
            result[:, a] = back @ Z0[:, a] + rotation.J @ Zxi[:, a]
            result[:, b] = back @ (Z0[:, b] + Zxi[:, b] - _hat(xi[:, b]) @ Z0[:, a])
        return result

    def _substep(self, q: Array, v: Array, u: Array, h: float, derivatives: bool) -> tuple[Array, Array, Array]:
        """q and v after h, and with `derivatives` the displacement and change of v by [displacement; v; u], (n, 2 nv, 2 nv + nu)."""
        n, nv = v.shape
        m = 2 * nv + self.nu if derivatives else 0
        Z0 = np.zeros((n, nv, m))
        Zu, Zv0 = np.zeros((self.nu, m)), np.zeros((n, nv, m))
        if derivatives:
            Z0[:, :, :nv], Zv0[:, :, nv:2 * nv], Zu[:, 2 * nv:] = np.eye(nv), np.eye(nv), np.eye(self.nu)
        xi, w, Zxi, Zw = np.zeros_like(v), v, np.zeros_like(Z0), Zv0
        total = [np.zeros_like(v), np.zeros_like(v), np.zeros_like(Z0), np.zeros_like(Z0)]
        for weight, after in ((1, 0.5), (2, 0.5), (2, 1.0), (1, 0.0)):
            rotations = self._rotations(xi)
            at = self._moved(q, xi)
            if derivatives:
                vdot, dq, dv, du = self._acceleration_derivatives(at, w, u)
                rates = [self._coordinate_rates(w, rotations), vdot, self._coordinate_rate_derivatives(w, rotations, Zxi, Zw),
                         dq @ self._displacements(xi, rotations, Z0, Zxi) + dv @ Zw + du @ Zu]
            else:
                rates = [self._coordinate_rates(w, rotations), self._acceleration(at, w, u), Zxi, Zw]
            for sum_, rate in zip(total, rates):
                sum_ += weight * h / 6 * rate
            xi, w = after * h * rates[0], v + after * h * rates[1]
            if derivatives:
                Zxi, Zw = after * h * rates[2], Zv0 + after * h * rates[3]
        rotations = self._rotations(total[0])
        moved = self._displacements(total[0], rotations, Z0, total[2]) if derivatives else Z0
        return self._moved(q, total[0]), v + total[1], np.concatenate([moved, Zv0 + total[3]], axis=1)

    def _arguments(self, x: ArrayLike, u: ArrayLike) -> tuple[Array, Array, bool]:
        x, u = np.asarray(x, dtype=float), np.asarray(u, dtype=float)
        for name, array, width in (("x", x, self.nx), ("u", u, self.nu)):
            if array.ndim not in (1, 2) or array.shape[-1] != width:
                raise ValueError(f"{name} has shape {array.shape}, expected ({width},), or (n, {width}) for n cases")
            if not np.all(np.isfinite(array)):
                raise ValueError(f"{name} has numbers that are not finite")
        alone = x.ndim == 1 and u.ndim == 1
        try:
            (n,) = np.broadcast_shapes(x.shape[:-1], u.shape[:-1], (1,))
        except ValueError:
            raise ValueError(f"x has shape {x.shape} and u has shape {u.shape}; expected the same number of cases") from None
        x, u = np.broadcast_to(x, (n, self.nx)), np.broadcast_to(u, (n, self.nu))
        if np.any(x[:, self.robot.nq + self._locked] != 0):
            raise ValueError("x has rates of locked joints; expected zero")
        for at, _ in self._bodies:
            norms = np.linalg.norm(x[:, at][:, 3:], axis=1)
            if np.any(np.abs(norms - 1) > 1e-6):
                raise ValueError(f"x has a quaternion of norm {norms[np.argmax(np.abs(norms - 1))]:.9g}; expected 1")
        return np.array(x), np.array(u), alone

    def __call__(self, x: ArrayLike, u: ArrayLike) -> Array:
        """f(x, u): the state after one step, (nx,) or (n, nx), from x, (nx,) or (n, nx), with u, (nu,) or (n, nu) [N m, N]."""
        x, u, alone = self._arguments(x, u)
        q, v = self.split(x)
        for _ in range(self.substeps):
            q, v, _ = self._substep(q, v, u, self.step / self.substeps, False)
        after = self.state(q, v)
        return np.asarray(after[0]) if alone else after

    def derivatives(self, x: ArrayLike, u: ArrayLike) -> tuple[Array, Array, Array]:
        """f, (nx,), with A, (ndx, ndx), and B, (ndx, nu), of minus(f(plus(x, dx), u + du), f(x, u)) = A dx + B du. For a batch the
        first axis of all arrays is that of the batch. They are the derivatives of the computed step, not of the continuous motion."""
        x, u, alone = self._arguments(x, u)
        parts = [self._derivatives(x[i:i + _CASES], u[i:i + _CASES]) for i in range(0, max(len(x), 1), _CASES)]
        after, A, B = (np.concatenate(one) if len(parts) > 1 else one[0] for one in zip(*parts))
        return (after[0], A[0], B[0]) if alone else (after, A, B)

    def _derivatives(self, x: Array, u: Array) -> tuple[Array, Array, Array]:
        q, v = self.split(x)
        nv = self.robot.nv
        both = np.concatenate([self._free, nv + self._free])
        A = np.broadcast_to(np.eye(2 * nv)[:, both], (len(x), 2 * nv, len(both)))
        B = np.zeros((len(x), 2 * nv, self.nu))
        for _ in range(self.substeps):
            q, v, Z = self._substep(q, v, u, self.step / self.substeps, True)
            A, B = Z[:, :, :2 * nv] @ A, Z[:, :, :2 * nv] @ B + Z[:, :, 2 * nv:]
        return self.state(q, v), A[:, both], B[:, both]

    def rollout(self, x: ArrayLike, u: ArrayLike) -> Array:
        """States of a motion, (steps + 1, nx), from x, (nx,), with the inputs u, (steps, nu)."""
        u = np.asarray(u, dtype=float)
        if u.ndim != 2 or u.shape[1] != self.nu:
            raise ValueError(f"u has shape {u.shape}, expected (steps, {self.nu})")
        states = [np.asarray(x, dtype=float)]
        for one in u:
            states.append(self(states[-1], one))
        return np.array(states)
