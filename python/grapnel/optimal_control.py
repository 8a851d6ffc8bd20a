"""Optimal control: regulators, quadratic programs, and optimal trajectories on the manifold of a robot's states.

    from grapnel import optimal_control as oc
    stack = grapnel.Robot(problem, targets=True).holding(q)              # after the capture, in the configuration q
    dynamics = oc.DiscreteDynamics(stack, step=0.5)
    cost = oc.TrackingCost(dynamics, Q, R, Q_final, reference=goal)
    plan = oc.ddp(dynamics, cost, x0, np.zeros((40, dynamics.nu)))       # inputs within the joints' effort limits

docs/how-to/optimal-control.md has examples, and shows the use with SciPy, CasADi and Crocoddyl.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from ._arguments import Array, whole_number
from .discrete_dynamics import DiscreteDynamics
from .linear_quadratic import QuadraticMinimum, Regulator, _matrix, _symmetric, box_qp, dlqr, lqr, solve_qp

__all__ = ["ActionModel", "Cost", "DiscreteDynamics", "Expansion", "Plan", "QuadraticMinimum", "Regulator", "ShootingProblem",
           "TrackingCost", "box_qp", "condense", "ddp", "dlqr", "lqr", "solve_qp"]


@dataclass(frozen=True)
class Expansion:
    """Derivatives of a cost along a trajectory of N steps, with respect to deviations dx of the states and changes of the inputs."""

    lx: Array  #: (N + 1, ndx); the last row is that of the final cost
    lu: Array  #: (N, nu)
    lxx: Array  #: (N + 1, ndx, ndx); a positive semidefinite approximation is sufficient
    lux: Array  #: (N, nu, ndx)
    luu: Array  #: (N, nu, nu), positive definite


class Cost(Protocol):
    """A cost of trajectories. `TrackingCost` is one; write a class with these two functions for another."""

    def value(self, xs: Array, us: Array) -> Array:
        """The cost of states xs, (..., N + 1, nx), and inputs us, (..., N, nu), for each trajectory, (...)."""

    def expansion(self, xs: Array, us: Array) -> Expansion:
        """Its derivatives along one trajectory, xs (N + 1, nx), us (N, nu)."""


class TrackingCost:
    """The sum of (dx^T Q dx + du^T R du) / 2 over the steps, and dx^T Q_final dx / 2 at the end, of the deviation
    dx = minus(x, reference) and du = u - reference_input.

    Q, Q_final (ndx, ndx), R (nu, nu), finite and symmetric, otherwise ValueError is raised. `reference`: a state (nx,), or one for each
    sample (N + 1, nx); `reference_input`: (nu,) or (N, nu), by default zero. The second derivatives leave out the curvature of minus()
    (Gauss-Newton)."""

    def __init__(self, dynamics: DiscreteDynamics, Q: ArrayLike, R: ArrayLike, Q_final: ArrayLike, reference: ArrayLike,
                 reference_input: ArrayLike | None = None) -> None:
        self.dynamics = dynamics
        self.Q, self.R = _symmetric("Q", Q, dynamics.ndx), _symmetric("R", R, dynamics.nu)
        self.Q_final = _symmetric("Q_final", Q_final, dynamics.ndx)
        self.reference = self._samples("reference", reference, "steps + 1", dynamics.nx)
        given = np.zeros(dynamics.nu) if reference_input is None else reference_input
        self.reference_input = self._samples("reference_input", given, "steps", dynamics.nu)

    @staticmethod
    def _samples(name: str, value: ArrayLike, count: str, width: int) -> Array:
        array = np.asarray(value, dtype=float)
        if array.ndim not in (1, 2) or array.shape[-1] != width:
            raise ValueError(f"{name} has shape {array.shape}, expected ({width},) or ({count}, {width})")
        return _matrix(name, array, array.shape)

    def value(self, xs: Array, us: Array) -> Array:
        """The cost of states xs, (..., N + 1, nx), and inputs us, (..., N, nu), for each trajectory, (...)."""
        dx, du = self.dynamics.minus(xs, self.reference), us - self.reference_input
        before, last = dx[..., :-1, :], dx[..., -1, :]
        running = np.einsum("...ki,ij,...kj->...", before, self.Q, before) + np.einsum("...ki,ij,...kj->...", du, self.R, du)
        return np.asarray(0.5 * (running + np.einsum("...i,ij,...j->...", last, self.Q_final, last)))

    def expansion(self, xs: Array, us: Array) -> Expansion:
        """Its derivatives along one trajectory, xs (N + 1, nx), us (N, nu)."""
        dx, J = self.dynamics.minus(xs, self.reference), self.dynamics.minus_jacobian(xs, self.reference)
        weights = np.concatenate([np.broadcast_to(self.Q, (len(us), *self.Q.shape)), self.Q_final[None]])
        weighted = np.swapaxes(J, 1, 2) @ weights
        return Expansion(np.einsum("kij,kj->ki", weighted, dx), (us - self.reference_input) @ self.R, weighted @ J,
                         np.zeros((len(us), self.dynamics.nu, self.dynamics.ndx)), np.broadcast_to(self.R, (len(us), *self.R.shape)))


class ShootingProblem:
    """The cost as a function of the inputs alone, for `scipy.optimize.minimize(problem.value_and_gradient, u0, jac=True)`.

    The inputs of `steps` steps are one vector, (steps * nu,), step by step; x0 (nx,) is the initial state."""

    def __init__(self, dynamics: DiscreteDynamics, cost: Cost, x0: ArrayLike, steps: int) -> None:
        self.dynamics, self.cost, self.x0 = dynamics, cost, np.asarray(x0, dtype=float)
        self.steps = whole_number("steps", steps, 1, 10**6)

    def value_and_gradient(self, u: ArrayLike) -> tuple[float, Array]:
        """The cost and its gradient, (steps * nu,), by the adjoint equations; exact for the discrete dynamics."""
        us = np.asarray(u, dtype=float).reshape(self.steps, self.dynamics.nu)
        xs = self.dynamics.rollout(self.x0, us)
        _, A, B = self.dynamics.derivatives(xs[:-1], us)
        along = self.cost.expansion(xs, us)
        return float(self.cost.value(xs, us)), _adjoint(A, B, along).ravel()

    def trajectory(self, u: ArrayLike) -> Array:
        """States, (steps + 1, nx), of inputs (steps * nu,)."""
        return self.dynamics.rollout(self.x0, np.asarray(u, dtype=float).reshape(self.steps, self.dynamics.nu))


def condense(dynamics: DiscreteDynamics, cost: Cost, xs: ArrayLike, us: ArrayLike) -> tuple[Array, Array, Array]:
    """The quadratic program of a cost about a trajectory, xs (N + 1, nx), us (N, nu), in the changes of all inputs, (N nu,), step by step.

    Returns P (N nu, N nu), q (N nu,) and G (N + 1, ndx, N nu): the cost changes by du^T P du / 2 + q^T du, and the deviations of the
    states by G du, to first order. Rows of G with bounds are limits of states for `solve_qp`, beside the identity for those of inputs."""
    xs, us = np.asarray(xs, dtype=float), np.asarray(us, dtype=float)
    steps, nu = us.shape
    _, A, B = dynamics.derivatives(xs[:-1], us)
    along = cost.expansion(xs, us)
    G = np.zeros((steps + 1, dynamics.ndx, steps * nu))
    for k in range(steps):
        G[k + 1] = A[k] @ G[k]
        G[k + 1, :, k * nu:(k + 1) * nu] += B[k]
    P = np.einsum("kia,kib->ab", G, along.lxx @ G, optimize=True)
    q = np.einsum("kia,ki->a", G, along.lx)
    for k in range(steps):
        own = slice(k * nu, (k + 1) * nu)
        mixed = along.lux[k] @ G[k]
        P[own] += mixed
        P[:, own] += mixed.T
        P[own, own] += along.luu[k]
        q[own] += along.lu[k]
    return 0.5 * (P + P.T), q, G


def _adjoint(A: Array, B: Array, along: Expansion) -> Array:
    """The gradient of the cost by the inputs, (N, nu): lu + B^T p with p = lx + A^T p of the next step."""
    gradient, p = np.empty_like(along.lu), along.lx[-1]
    for k in reversed(range(len(B))):
        gradient[k] = along.lu[k] + B[k].T @ p
        p = along.lx[k] + A[k].T @ p
    return gradient


class ActionModel:
    """One step with its cost, with the functions of Crocoddyl's action models: `calc` and `calcDiff`, which write to `data`.

    `cost`: of trajectories; this model evaluates it on a single step. Crocoddyl calls `calc(data, x)` without u at the end of the
    horizon: then the cost is the final one."""

    def __init__(self, dynamics: DiscreteDynamics, cost: Cost) -> None:
        self.dynamics, self.cost = dynamics, cost
        self.nx, self.ndx, self.nu = dynamics.nx, dynamics.ndx, dynamics.nu
        self.u_lb, self.u_ub = dynamics.lower, dynamics.upper

    def createData(self) -> SimpleNamespace:  # noqa: N802, the name of Crocoddyl
        """Storage for xnext, cost, Fx, Fu, Lx, Lu, Lxx, Lxu and Luu."""
        return SimpleNamespace(xnext=np.zeros(self.nx), cost=0.0, Fx=np.eye(self.ndx), Fu=np.zeros((self.ndx, self.nu)), Lx=np.zeros(self.ndx),
                               Lu=np.zeros(self.nu), Lxx=np.zeros((self.ndx, self.ndx)), Lxu=np.zeros((self.ndx, self.nu)),
                               Luu=np.zeros((self.nu, self.nu)))

    def calc(self, data: SimpleNamespace, x: ArrayLike, u: ArrayLike | None = None) -> None:
        """Writes xnext (nx,) and cost."""
        x = np.asarray(x, dtype=float)
        total = float(self.cost.value(x[None], np.zeros((0, self.nu))))
        if u is None:
            data.xnext, data.cost = x, total
            return
        u = np.asarray(u, dtype=float)
        data.xnext = self.dynamics(x, u)
        after = float(self.cost.value(data.xnext[None], np.zeros((0, self.nu))))
        data.cost = float(self.cost.value(np.stack([x, data.xnext]), u[None])) - after

    def calcDiff(self, data: SimpleNamespace, x: ArrayLike, u: ArrayLike | None = None) -> None:  # noqa: N802, the name of Crocoddyl
        """Writes Fx (ndx, ndx), Fu (ndx, nu), Lx, Lu, Lxx, Lxu (ndx, nu) and Luu. Call `calc` first."""
        x = np.asarray(x, dtype=float)
        if u is None:
            along = self.cost.expansion(x[None], np.zeros((0, self.nu)))
            data.Lx, data.Lxx = along.lx[-1], along.lxx[-1]
            return
        u = np.asarray(u, dtype=float)
        data.xnext, data.Fx, data.Fu = self.dynamics.derivatives(x, u)
        along = self.cost.expansion(np.stack([x, data.xnext]), u[None])
        data.Lx, data.Lu, data.Lxx, data.Lxu, data.Luu = along.lx[0], along.lu[0], along.lxx[0], along.lux[0].T, along.luu[0]


@dataclass(frozen=True)
class Plan:
    """Result of `ddp`. The feedback law is u = us[k] + K[k] minus(x, xs[k]), within the limits."""

    xs: Array  #: states, (N + 1, nx)
    us: Array  #: inputs, (N, nu), within the limits
    K: Array  #: gains about xs and us, (N, nu, ndx); rows of inputs that the model holds at a limit are zero
    cost: float  #: of xs and us
    status: str = "not run"  #: 'converged', 'iterations' (too few) or 'no descent' (rounding errors, or a cost that is not smooth)
    iterations: int = 0  #: number of iterations
    gradient: float = np.inf  #: improvement within the limits that the quadratic model predicts, relative to the cost; 0 at a minimum
    costs: list[float] = field(default_factory=list)  #: after each iteration, the initial one first

    @property
    def converged(self) -> bool:
        """Whether status is 'converged'."""
        return self.status == "converged"


class _Backward:
    """Gains of one backward pass, and the improvement that its quadratic model predicts."""

    def __init__(self, A: Array, B: Array, along: Expansion, us: Array, limits: tuple[Array, Array], mu: float) -> None:
        steps, nu = us.shape
        self.k, self.K = np.zeros((steps, nu)), np.zeros((steps, nu, A.shape[2]))
        self.linear = self.quadratic = 0.0
        Vx, Vxx = along.lx[-1], along.lxx[-1]
        for i in reversed(range(steps)):
            AV, BV = A[i].T @ Vxx, B[i].T @ Vxx
            Qx, Qu = along.lx[i] + A[i].T @ Vx, along.lu[i] + B[i].T @ Vx
            Qxx, Qux, Quu = along.lxx[i] + AV @ A[i], along.lux[i] + BV @ A[i], along.luu[i] + BV @ B[i]
            Quu = 0.5 * (Quu + Quu.T)
            damped = Quu + mu * np.diag(np.diag(Quu))  # Levenberg-Marquardt: independent of the units of inputs
            best = box_qp(damped, Qu, limits[0] - us[i], limits[1] - us[i])
            k, free = best.x, best.free
            K = np.zeros_like(Qux)
            if np.any(free):
                K[free] = -np.linalg.solve(damped[np.ix_(free, free)], Qux[free])
            self.k[i], self.K[i] = k, K
            self.linear += float(k @ Qu)
            self.quadratic += float(0.5 * k @ Quu @ k)
            Vx = Qx + K.T @ (Quu @ k + Qu) + Qux.T @ k
            Vxx = Qxx + K.T @ Quu @ K + K.T @ Qux + Qux.T @ K
            Vxx = 0.5 * (Vxx + Vxx.T)


def _forward(dynamics: DiscreteDynamics, x0: Array, xs: Array, us: Array, gains: _Backward, limits: tuple[Array, Array],
             alphas: Array) -> tuple[Array, Array, Array]:
    """Trajectories with the gains for all step sizes, as one batch: states (alphas, N + 1, nx), inputs (alphas, N, nu), and whether
    `dynamics` accepts all steps, (alphas,). States after a step that it does not accept are those of xs."""
    n = len(alphas)
    new_x, new_u, valid = np.tile(xs, (n, 1, 1)), np.tile(us, (n, 1, 1)), np.ones(n, dtype=bool)
    new_x[:, 0] = x0
    for i in range(len(us)):
        rows = np.flatnonzero(valid)
        dx = dynamics.minus(new_x[rows, i], xs[i])
        inputs = np.clip(us[i] + alphas[rows, None] * gains.k[i] + dx @ gains.K[i].T, *limits)
        try:
            new_x[rows, i + 1] = dynamics(new_x[rows, i], inputs)
        except ValueError:  # of one or more trajectories
            for row, one in zip(rows, inputs):
                try:
                    new_x[row, i + 1] = dynamics(new_x[row, i], one)
                except ValueError:
                    valid[row] = False
        new_u[rows, i] = inputs
        if not np.any(valid):
            break
    return new_x, new_u, valid


def ddp(dynamics: DiscreteDynamics, cost: Cost, x0: ArrayLike, us: ArrayLike, lower: ArrayLike | None = None,
        upper: ArrayLike | None = None, iterations: int = 100, tolerance: float = 1e-9) -> Plan:
    """The inputs within limits that minimize a cost from x0, (nx,): differential dynamic programming with box limits (Tassa, Mansard
    and Todorov 2014) on the manifold of states, with the first derivatives of the dynamics (iLQR).

    `us`: initial guess, (N, nu), which is clipped. `lower`, `upper`: (nu,), by default those of `dynamics`. The iteration is
    converged when its quadratic model predicts an improvement of at most `tolerance` of the cost. It finds a local minimum. The
    result states the cause of its end. The guess itself must have a motion that `dynamics` accepts, otherwise ValueError is raised;
    steps of the search whose motion it does not accept are shortened."""
    guess = np.asarray(us, dtype=float)
    if guess.ndim != 2 or guess.shape[1] != dynamics.nu or not len(guess):
        raise ValueError(f"us has shape {guess.shape}, expected (steps, {dynamics.nu})")
    limits = (dynamics.lower if lower is None else np.broadcast_to(np.asarray(lower, dtype=float), (dynamics.nu,)),
              dynamics.upper if upper is None else np.broadcast_to(np.asarray(upper, dtype=float), (dynamics.nu,)))
    if np.any(limits[0] > limits[1]):
        raise ValueError("lower exceeds upper")
    start, inputs = np.asarray(x0, dtype=float), np.clip(guess, *limits)
    xs = dynamics.rollout(start, inputs)
    best = float(cost.value(xs, inputs))
    costs, mu, alphas, status = [best], 0.0, 0.5 ** np.arange(10), "iterations"
    gains, decrement = None, np.inf
    for _ in range(whole_number("iterations", iterations, 1, 10**6)):
        _, A, B = dynamics.derivatives(xs[:-1], inputs)
        along = cost.expansion(xs, inputs)
        while True:
            gains = _Backward(A, B, along, inputs, limits, mu)
            decrement = -(gains.linear + gains.quadratic) / max(abs(best), 1e-300)
            if mu == 0 and decrement <= tolerance:
                status = "converged"
                break
            new_x, new_u, valid = _forward(dynamics, start, xs, inputs, gains, limits, alphas)
            values = np.array(cost.value(new_x, new_u))
            values[~valid | ~np.isfinite(values)] = np.inf
            predicted = -(alphas * gains.linear + alphas**2 * gains.quadratic)
            fine = (best - values >= 1e-4 * predicted) & (best > values)
            if np.any(fine):
                at = int(np.argmax(fine))
                xs, inputs, best = new_x[at], new_u[at], float(values[at])
                mu = 0.0 if mu < 1e-6 else mu / 10
                break
            mu = max(10 * mu, 1e-6)
            if mu > 1e6:
                status = "no descent"
                break
        costs.append(best)
        if status != "iterations":
            break
    if status != "converged":  # the last gains are damped, or of the trajectory before
        _, A, B = dynamics.derivatives(xs[:-1], inputs)
        gains = _Backward(A, B, cost.expansion(xs, inputs), inputs, limits, 0.0)
        decrement = -(gains.linear + gains.quadratic) / max(abs(best), 1e-300)
        if decrement <= tolerance:
            status = "converged"
    assert gains is not None
    return Plan(xs, inputs, gains.K, best, status, len(costs) - 1, float(decrement), costs)
