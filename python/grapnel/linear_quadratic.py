"""Linear-quadratic regulators and quadratic programs, in NumPy alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from ._arguments import Array


def _matrix(name: str, value: ArrayLike, shape: tuple[int, ...], is_bound: bool = False) -> Array:
    """The value as an array. Bounds may be infinite."""
    array = np.asarray(value, dtype=float)
    if array.shape != shape:
        raise ValueError(f"{name} has shape {array.shape}, expected {shape}")
    if np.any(np.isnan(array)):
        raise ValueError(f"{name} has numbers that are nan")
    if not is_bound and not np.all(np.isfinite(array)):
        raise ValueError(f"{name} has infinite numbers")
    return array


def _symmetric(name: str, value: ArrayLike, size: int) -> Array:
    array = _matrix(name, value, (size, size))
    if np.abs(array - array.T).max(initial=0) > 1e-9 * np.abs(array).max(initial=0):
        raise ValueError(f"{name} is not symmetric")
    return array


# ---- Riccati equations ----


@dataclass(frozen=True)
class Regulator:
    """Result of `lqr` and `dlqr`: u = -K x minimizes the cost, whose minimum is x^T P x."""

    K: Array  #: gain, (nu, nx)
    P: Array  #: stabilizing solution of the Riccati equation, (nx, nx), symmetric
    eigenvalues: Array  #: of A - B K, (nx,): in 1/s for `lqr`, of one step for `dlqr`
    residual: float  #: largest entry of the Riccati equation's residual, relative to the largest entry of its terms


def _weights(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None) -> tuple[Array, Array, Array, Array, Array]:
    A = np.asarray(A, dtype=float)
    if A.ndim != 2 or A.shape[0] != A.shape[1]:
        raise ValueError(f"A has shape {A.shape}, expected a square matrix")
    B = np.asarray(B, dtype=float)
    if B.ndim != 2:
        raise ValueError(f"B has shape {B.shape}, expected ({len(A)}, inputs)")
    n, m = len(A), B.shape[1]
    A, B, Q, R = _matrix("A", A, (n, n)), _matrix("B", B, (n, m)), _symmetric("Q", Q, n), _symmetric("R", R, m)
    N = np.zeros((n, m)) if N is None else _matrix("N", N, (n, m))
    if np.linalg.eigvalsh(R)[0] <= 0:
        raise ValueError("R has an eigenvalue that is not positive: every input needs a cost")
    if np.linalg.eigvalsh(Q - N @ np.linalg.solve(R, N.T))[0] < -1e-9 * max(np.abs(Q).max(), 1e-300):
        raise ValueError("Q - N R^-1 N^T has a negative eigenvalue: the cost has no minimum")
    return A, B, Q, R, N


def _doubling(A: Array, G: Array, H: Array) -> Array:
    """The stabilizing X of X = A^T X (1 + G X)^-1 A + H (Chu, Fan, Lin and Wang 2004, structure-preserving doubling)."""
    one = np.eye(len(A))
    for _ in range(60):
        with np.errstate(over="ignore", invalid="ignore"):  # without a solution the iteration diverges
            try:
                W = np.linalg.solve(one + G @ H, np.concatenate([A, G], axis=1))
            except np.linalg.LinAlgError:
                raise ValueError(_NO_SOLUTION) from None
            WA, WG = W[:, :len(A)], W[:, len(A):]
            step = A.T @ H @ WA
            A, G, H = A @ WA, G + A @ WG @ A.T, H + step
        G, H = 0.5 * (G + G.T), 0.5 * (H + H.T)
        if not np.all(np.isfinite(H)):
            break
        if np.abs(step).max() <= 1e-15 * np.abs(H).max():
            return H
    raise ValueError(_NO_SOLUTION)


_NO_SOLUTION = ("the Riccati equation has no stabilizing solution: an unstable or undamped mode is not controllable by B, or has no cost in Q. "
                "Leave out states that nothing controls, such as conserved momenta, or that have no cost, such as angles of wheels")


def _checked(P: Array, K: Array, closed: Array, terms: list[Array], is_stable: bool) -> Regulator:
    residual = float(np.abs(sum(terms)).max() / max(max(np.abs(term).max() for term in terms), 1e-300))
    if not is_stable or not residual <= 1e-8:
        raise ValueError(f"{_NO_SOLUTION} (relative residual {residual:.2g})")
    return Regulator(K, P, np.linalg.eigvals(closed), residual)


def lqr(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None) -> Regulator:
    """The regulator u = -K x of x' = A x + B u that minimizes the integral of x^T Q x + u^T R u + 2 x^T N u over infinite time.

    A (nx, nx), B (nx, nu), Q (nx, nx) symmetric and positive semidefinite, R (nu, nu) symmetric and positive definite, N (nx, nu).
    The Riccati equation A^T P + P A - (P B + N) R^-1 (B^T P + N^T) + Q = 0 becomes one of discrete time by the Cayley transform and
    is solved by doubling. Raises ValueError if no solution stabilizes, or if the relative residual exceeds 1e-8.
    `scipy.linalg.solve_continuous_are` solves the same equation; it is not used."""
    A, B, Q, R, N = _weights(A, B, Q, R, N)
    R_N, one = np.linalg.solve(R, N.T), np.eye(len(A))
    F, H, G = A - B @ R_N, Q - N @ R_N, B @ np.linalg.solve(R, B.T)
    size = np.abs(np.linalg.eigvals(np.block([[F, -G], [-H, -F.T]])))
    if size.min() <= 1e-14 * size.max():
        raise ValueError(_NO_SOLUTION)
    gamma = float(np.sqrt(size.min() * size.max()))  # maps the eigenvalues farthest from the unit circle
    for factor in (1.0, 1.7, 0.6):  # F - gamma may be singular
        shifted = F - factor * gamma * one
        if np.linalg.cond(shifted) < 1e12:
            break
    gamma *= factor
    try:
        inverse = np.linalg.inv(shifted)
        inverse_W = np.linalg.inv(shifted.T + H @ inverse @ G)
    except np.linalg.LinAlgError:
        raise ValueError(_NO_SOLUTION) from None
    P = _doubling(one + 2 * gamma * inverse_W.T, 2 * gamma * inverse @ G @ inverse_W, 2 * gamma * inverse_W @ H @ inverse)
    P = 0.5 * (P + P.T)
    K = np.linalg.solve(R, B.T @ P + N.T)
    closed: Array = A - B @ K
    return _checked(P, K, closed, [A.T @ P, P @ A, -K.T @ R @ K, Q], bool(np.linalg.eigvals(closed).real.max() < 0))


def dlqr(A: ArrayLike, B: ArrayLike, Q: ArrayLike, R: ArrayLike, N: ArrayLike | None = None) -> Regulator:
    """The regulator u = -K x of x+ = A x + B u that minimizes the sum of x^T Q x + u^T R u + 2 x^T N u over all steps.

    Arguments as of `lqr`; P = A^T P A - (A^T P B + N) (R + B^T P B)^-1 (B^T P A + N^T) + Q. Raises ValueError if no solution
    stabilizes, or if the relative residual exceeds 1e-8. `scipy.linalg.solve_discrete_are` solves the same equation; it is not used."""
    A, B, Q, R, N = _weights(A, B, Q, R, N)
    R_N = np.linalg.solve(R, N.T)
    P = _doubling(A - B @ R_N, B @ np.linalg.solve(R, B.T), Q - N @ R_N)
    S = R + B.T @ P @ B
    try:
        K = np.linalg.solve(S, B.T @ P @ A + N.T)
    except np.linalg.LinAlgError:
        raise ValueError(_NO_SOLUTION) from None
    closed = A - B @ K
    return _checked(P, K, closed, [A.T @ P @ A, -K.T @ S @ K, Q, -P], bool(np.abs(np.linalg.eigvals(closed)).max() < 1))


# ---- Quadratic programs ----


@dataclass(frozen=True)
class QuadraticMinimum:
    """Result of `box_qp` and `solve_qp`."""

    x: Array  #: the minimum, (n,)
    free: Array  #: of `box_qp`: whether a variable is off its bounds; of `solve_qp`: whether a row of A is, booleans
    multipliers: Array  #: of the bounds (`box_qp`) or rows (`solve_qp`), positive at upper bounds
    iterations: int  #: number of iterations
    residual: float  #: largest violation of the optimality conditions, relative to the largest terms
    converged: bool  #: whether the residual is at most the tolerance; of `box_qp` without further descent, 100 times the tolerance


def box_qp(H: ArrayLike, g: ArrayLike, lower: ArrayLike, upper: ArrayLike, start: ArrayLike | None = None,
           tolerance: float = 1e-10) -> QuadraticMinimum:
    """Minimizes x^T H x / 2 + g^T x for lower <= x <= upper, by the projected Newton method (Bertsekas 1982).

    H (n, n) is symmetric and positive definite, otherwise ValueError is raised; g, lower, upper and start (n,). Bounds may be
    infinite."""
    n = np.size(g)
    P, q = _symmetric("H", H, n), _matrix("g", g, (n,))
    least, most = _matrix("lower", lower, (n,), is_bound=True), _matrix("upper", upper, (n,), is_bound=True)
    if np.any(least > most):
        raise ValueError("lower exceeds upper")
    x = np.clip(np.zeros(n) if start is None else _matrix("start", start, (n,)), least, most)
    try:
        np.linalg.cholesky(P)
    except np.linalg.LinAlgError:
        raise ValueError("H is not positive definite") from None
    scale = max(float(np.abs(q).max(initial=0)), 1e-300)

    def conditions(x: Array) -> tuple[Array, Array, float]:
        gradient = P @ x + q
        held = ((x <= least) & (gradient > 0)) | ((x >= most) & (gradient < 0))
        size = max(scale, float(np.abs(P * x).max(initial=0)))
        return gradient, ~held, float(np.abs(gradient[~held]).max(initial=0)) / size

    for iteration in range(100):
        gradient, free, residual = conditions(x)
        if residual <= tolerance:
            return QuadraticMinimum(x, free, np.where(free, 0, -gradient), iteration, residual, True)
        step = np.zeros(n)
        step[free] = -np.linalg.solve(P[np.ix_(free, free)], gradient[free])
        value, alpha, after = 0.5 * x @ P @ x + q @ x, 1.0, x
        while alpha > 1e-12:
            after = np.clip(x + alpha * step, least, most)
            if 0.5 * after @ P @ after + q @ after <= value + 0.1 * gradient @ (after - x):
                break
            alpha *= 0.5
        if np.array_equal(after, x):
            break
        x = after
    gradient, free, residual = conditions(x)
    return QuadraticMinimum(x, free, np.where(free, 0, -gradient), iteration + 1, residual, residual <= 100 * tolerance)


def solve_qp(P: ArrayLike, q: ArrayLike, A: ArrayLike, lower: ArrayLike, upper: ArrayLike, start: QuadraticMinimum | None = None,
             tolerance: float = 1e-8, iterations: int = 4000) -> QuadraticMinimum:
    """Minimizes x^T P x / 2 + q^T x for lower <= A x <= upper, by the alternating direction method of OSQP (Stellato et al. 2020)
    with a final solution on the active rows.

    P (n, n) symmetric and positive semidefinite, otherwise ValueError is raised; q (n,), A (rows, n), lower and upper (rows,),
    infinite without a bound. `start`: the result of a problem of the same sizes. A problem without a solution ends with converged
    False; `residual` is the largest violation of stationarity and of the rows at their bounds, relative to the largest terms."""
    n, rows = np.size(q), len(np.atleast_1d(A))
    H, g, E = _symmetric("P", P, n), _matrix("q", q, (n,)), _matrix("A", A, (rows, n))
    least, most = _matrix("lower", lower, (rows,), is_bound=True), _matrix("upper", upper, (rows,), is_bound=True)
    if np.any(least > most):
        raise ValueError("lower exceeds upper")
    if np.any(np.linalg.eigvalsh(H) < -1e-9 * np.abs(H).max(initial=0)):
        raise ValueError("P has a negative eigenvalue")
    # Rows of norm 1 and a cost of norm 1, so that one penalty fits all.
    norms = np.maximum(np.linalg.norm(E, axis=1), 1e-300)
    cost = 1 / max(float(np.abs(H).max(initial=0)), 1e-300)
    C, low, high, Pc, qc = E / norms[:, None], least / norms, most / norms, cost * H, cost * g

    size = max(1e-8 * float(np.abs(qc).max(initial=0)), 1e-300)  # of a minimum near zero, whose rows have rounding errors alone

    def residuals(x: Array, z: Array, y: Array) -> tuple[float, float]:
        primal = np.abs(C @ x - z).max(initial=0) / max(np.abs(C @ x).max(initial=0), np.abs(z).max(initial=0), size)
        dual_size = max(np.abs(Pc @ x).max(initial=0), np.abs(C.T @ y).max(initial=0), np.abs(qc).max(initial=0), 1e-300)
        return float(primal), float(np.abs(Pc @ x + qc + C.T @ y).max(initial=0) / dual_size)

    def ended(x: Array, z: Array, y: Array, count: int) -> QuadraticMinimum:
        # z: values of the rows within their bounds, at the bound where y is not zero.
        residual = max(residuals(x, z, y))
        return QuadraticMinimum(x, y == 0, y / norms / cost, count, residual, residual <= tolerance)

    sigma, rho, equal = 1e-6, 0.1, low == high
    x = np.zeros(n) if start is None else _matrix("start.x", start.x, (n,))
    y = np.zeros(rows) if start is None else _matrix("start.multipliers", start.multipliers, (rows,)) * norms * cost
    z = np.clip(C @ x, low, high)
    factor: Array | None = None
    # The bounds may differ from those of the start: off them a multiplier is none of a minimum.
    best = ended(x, z, np.where((y > 0) & (z < high) | (y < 0) & (z > low), 0.0, y), 0)
    for count in range(1, iterations + 1):
        penalty = np.where(equal, 1000 * rho, rho)
        if factor is None:
            factor = np.linalg.inv(Pc + sigma * np.eye(n) + C.T @ (penalty[:, None] * C))
        x_new = factor @ (sigma * x - qc + C.T @ (penalty * z - y))
        z_free = C @ x_new
        x, mixed = 1.6 * x_new - 0.6 * x, 1.6 * z_free - 0.6 * z
        z_new = np.clip(mixed + y / penalty, low, high)
        y, z = y + penalty * (mixed - z_new), z_new
        if count % 25:
            continue
        polished = _polished(Pc, qc, C, low, high, z, y)
        if polished is not None:
            x_active, y_active = polished
            z_active = np.where(y_active > 0, high, np.where(y_active < 0, low, np.clip(C @ x_active, low, high)))
            candidate = ended(x_active, z_active, y_active, count)
            best = candidate if candidate.residual < best.residual else best
            if best.converged:
                return best
        primal, dual = residuals(x, z, y)
        ratio = np.sqrt(max(primal, 1e-300) / max(dual, 1e-300))
        if (ratio > 5 or ratio < 0.2) and count % 100 == 0:
            rho, factor = float(np.clip(rho * ratio, 1e-6, 1e6)), None
    last = ended(x, z, y, iterations)
    return last if last.residual < best.residual else best


def _polished(P: Array, q: Array, C: Array, low: Array, high: Array, z: Array, y: Array) -> tuple[Array, Array] | None:
    """The minimum with the rows that multipliers hold as equations; None if a multiplier then has the wrong sign."""
    at_low, at_high = (y < 0) & (z <= low), (y > 0) & (z >= high)
    active = at_low | at_high
    value = np.where(at_low, low, high)[active]
    n, m = len(P), int(active.sum())
    E = C[active]
    K = np.block([[P, E.T], [E, np.zeros((m, m))]])
    shifted = K + np.diag(np.concatenate([np.full(n, 1e-9), np.full(m, -1e-9)]))
    right = np.concatenate([-q, value])
    try:
        inverse = np.linalg.inv(shifted)
    except np.linalg.LinAlgError:
        return None
    solution = inverse @ right
    for _ in range(3):
        solution = solution + inverse @ (right - K @ solution)
    multipliers = np.zeros(len(C))
    multipliers[active] = solution[n:]
    wrong = ((multipliers < 0) & at_high | (multipliers > 0) & at_low) & (low != high)
    return None if np.any(wrong) else (solution[:n], multipliers)
