"""What an arm holds: mass, centre of mass and inertia from measured rates."""

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
    """What samples say of a held body, in its frame. Where the motion does not show a parameter, nothing is guessed."""

    value: Array  #: the ten of PARAMETERS, (10,): mass, centre of mass, inertia about it; nan where not determined
    deviation: Array  #: their standard deviations, (10,), of the stated noise; nan without noise
    mass: str  #: 'determined', 'ratio_only' (with one number more it would be known) or 'not_determined'
    com: str  #: the same of the centre of mass
    inertia: str  #: the same of the inertia
    rank: int  #: how many of ten independent numbers the motion shows
    condition: float  #: largest over smallest singular value that counts
    residual: float  #: near 1 if the noise is what is stated; 0 where all equations are needed
    converged: bool  #: whether the iteration on weights and rates came to its end
    iterations: int  #: how many it took
    unseen: tuple[str, ...]  #: changes that no sample shows: 'mass + 1 kg with first_moment_x + 0.3 kg m'
    impossible: str  #: why no body has these parameters; empty: one can have them, or not all are determined

    @property
    def all_determined(self) -> bool:
        """Whether all ten are."""
        return self.rank == len(PARAMETERS)

    def __getitem__(self, parameter: str) -> float:
        """A value by its name in PARAMETERS."""
        if parameter not in PARAMETERS:
            raise KeyError(f"{parameter!r} is no parameter; expected is one of {', '.join(PARAMETERS)}")
        return float(self.value[PARAMETERS.index(parameter)])


def identify(robot: Robot, frame: str, q: ArrayLike, v: ArrayLike, *, impulse: ArrayLike | None = None, base: str = "twist",
             momentum: ArrayLike | None = None, angular_velocity: float = 0.0, velocity: float = 0.0,
             joint_rate: float = 0.0) -> Identification:
    """Mass, centre of mass and inertia of the body that carries `frame`, which the robot holds, by weighted least squares on the
    momentum of samples (docs/theory.md, section 16).

    `robot` knows the masses of all other bodies, such as `Robot(problem, targets=True).holding(q)`; what it says of this one's is not
    read. `q`, `v`: samples, (n, nq) and (n, nv), with measured velocities. `impulse`: known, from outside since the first sample,
    [angular about W's origin; linear] in W, (n, 6); None: zero. `base`: 'twist', the base's velocity is measured too, or 'rotation', a
    gyroscope alone: then its place and velocity are not read, and no force may act. `momentum`: the total at the first sample, [angular about
    W's origin; linear] in W, (6,), with 'rotation' about the centre of mass; None: not known. `angular_velocity` [rad/s], `velocity` [m/s]
    and `joint_rate` [rad/s or m/s]: standard deviations of what sensors add, per axis of the base and per joint; they weigh the samples and give
    `deviation`. ValueError where the frame's body is the base, the base is fixed, or shapes are wrong."""
    found = _grapnel.identify(robot._core, frame, q, v, impulse, base, momentum, float(angular_velocity), float(velocity),
                              float(joint_rate))
    found["unseen"] = tuple(found["unseen"])
    return Identification(**found)
