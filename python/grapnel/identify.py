"""Identification of a held body: mass, centre of mass and inertia from measured rates."""

from __future__ import annotations

from dataclasses import dataclass

from numpy.typing import ArrayLike

from . import _grapnel
from ._arguments import Array
from .robot import Robot

#: Names of the ten parameters, in the order of `Identification.value`: mass [kg], centre of mass [m] and inertia about it [kg m^2].
PARAMETERS = tuple(_grapnel.inertial_parameters())


@dataclass(frozen=True)
class Identification:
    """Result of `identify`: mass properties of a held body, in its frame. Parameters that the motion does not determine are nan."""

    value: Array  #: values of PARAMETERS, (10,): mass, centre of mass, inertia about it; nan if not determined
    deviation: Array  #: their standard deviations, (10,), for the given noise; nan without noise
    mass: str  #: 'determined', 'ratio_only' (one more known quantity would determine it) or 'not_determined'
    com: str  #: the same for the centre of mass
    inertia: str  #: the same for the inertia
    rank: int  #: how many of the ten independent parameters the motion determines
    condition: float  #: ratio of the maximum to the minimum singular value within the rank
    residual: float  #: near 1 if the noise is as given; 0 if all equations are needed
    converged: bool  #: whether the iteration on weights and rates converged
    iterations: int  #: number of iterations
    unseen: tuple[str, ...]  #: undetermined combined changes: 'mass + 1 kg with first_moment_x + 0.3 kg m'
    impossible: str  #: why no rigid body has these parameters; empty: they are possible, or not all are determined

    @property
    def all_determined(self) -> bool:
        """Whether all ten parameters are determined."""
        return self.rank == len(PARAMETERS)

    def __getitem__(self, parameter: str) -> float:
        """The value of a parameter, by its name in PARAMETERS."""
        if parameter not in PARAMETERS:
            raise KeyError(f"{parameter!r} is not a parameter; expected one of {', '.join(PARAMETERS)}")
        return float(self.value[PARAMETERS.index(parameter)])


def identify(robot: Robot, frame: str, q: ArrayLike, v: ArrayLike, *, impulse: ArrayLike | None = None, base: str = "twist",
             momentum: ArrayLike | None = None, angular_velocity: float = 0.0, velocity: float = 0.0,
             joint_rate: float = 0.0) -> Identification:
    """Estimates mass, centre of mass and inertia of the held body that carries `frame`, by weighted least squares on the momentum
    of samples (docs/theory, section 16).

    `robot`: the joined system with the masses of all other bodies, such as `Robot(problem, targets=True).holding(q)`; its mass
    properties of the held body are not used.
    `q`, `v`: samples, (n, nq) and (n, nv), with measured velocities.
    `impulse`: known external impulse since the first sample, [angular about W's origin; linear] in W, (n, 6); None: zero.
    `base`: 'twist', the base's velocity is measured too, or 'rotation', a gyroscope alone; position and velocity of the base are then
    not used, and no external force may act.
    `momentum`: total momentum at the first sample, [angular about W's origin; linear] in W, (6,), with 'rotation' about the centre of
    mass; None: not known.
    `angular_velocity` [rad/s], `velocity` [m/s] and `joint_rate` [rad/s or m/s]: standard deviations of the sensor noise, per axis of
    the base and per joint. They weight the samples and give `deviation`.

    Raises ValueError if the frame's body is the base, the base is fixed, or shapes are wrong."""
    found = _grapnel.identify(robot._core, frame, q, v, impulse, base, momentum, float(angular_velocity), float(velocity),
                              float(joint_rate))
    found["unseen"] = tuple(found["unseen"])
    return Identification(**found)
