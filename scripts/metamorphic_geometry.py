"""Vectors, quaternions (w, x, y, z) and poses as lists, for scripts/metamorphic. Standard library only."""
import math


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def sub(a, b):
    return [x - y for x, y in zip(a, b)]


def scale(s, a):
    return [s * x for x in a]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a):
    return math.sqrt(dot(a, a))


def unit(a):
    return scale(1 / norm(a), a)


def multiply(p, q):
    v = add(add(scale(p[0], q[1:]), scale(q[0], p[1:])), cross(p[1:], q[1:]))
    return [p[0] * q[0] - dot(p[1:], q[1:])] + v


def conjugate(q):
    return [q[0], -q[1], -q[2], -q[3]]


def turn(q, v):
    """The vector v, turned by the quaternion q."""
    t = scale(2, cross(q[1:], v))
    return add(add(v, scale(q[0], t)), cross(q[1:], t))


def about(axis, angle):
    return [math.cos(angle / 2)] + scale(math.sin(angle / 2), axis)


def compose(X, Y):
    """Poses (position, quaternion): X after Y."""
    return (add(X[0], turn(X[1], Y[0])), multiply(X[1], Y[1]))


def inverse(X):
    q = conjugate(X[1])
    return (scale(-1, turn(q, X[0])), q)


IDENTITY = ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0])


def matrix(q):
    columns = [turn(q, e) for e in ([1, 0, 0], [0, 1, 0], [0, 0, 1])]
    return [[columns[j][i] for j in range(3)] for i in range(3)]


def tensor(six):
    xx, yy, zz, xy, xz, yz = six
    return [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]


def six(t):
    return [t[0][0], t[1][1], t[2][2], 0.5 * (t[0][1] + t[1][0]), 0.5 * (t[0][2] + t[2][0]), 0.5 * (t[1][2] + t[2][1])]


def turn_inertia(q, inertia):
    """Six numbers of an inertia in other axes: R I R^T."""
    R, I = matrix(q), tensor(inertia)
    RI = [[sum(R[i][k] * I[k][j] for k in range(3)) for j in range(3)] for i in range(3)]
    return six([[sum(RI[i][k] * R[j][k] for k in range(3)) for j in range(3)] for i in range(3)])


def point_inertia(mass, r):
    """Six numbers of the inertia of a point mass at r."""
    rr = dot(r, r)
    return six([[mass * ((rr if i == j else 0) - r[i] * r[j]) for j in range(3)] for i in range(3)])
