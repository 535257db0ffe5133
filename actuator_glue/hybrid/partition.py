"""How a hybrid test divides its structure: the numerical part, the specimen, the sampling."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy
from numpy.typing import ArrayLike

from actuator_glue.errors import InputError
from actuator_glue.given import number, of_kind, take_numbers
from actuator_glue.records import Array, check_stiffness

_LARGEST = 200  # degrees of freedom


@dataclass(frozen=True, slots=True)
class Specimen:
    """The experimental substructure, one degree of freedom.

    Attributes:
        mass: m_e [kg].
        damping: c_e [kg/s].
        stiffness: k_e [N/m].
        stddev: standard deviation of any of the three, by name.
    """

    mass: float
    damping: float
    stiffness: float
    stddev: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        take_numbers(self)
        check_stiffness(self.stiffness, 'experimental')
        of_kind(self.stddev, 'stddev', Mapping, 'standard deviations by name, as {"mass": 1.0}')
        stddev = {n: number(sd, f'standard deviation of {n}') for n, sd in self.stddev.items()}
        object.__setattr__(self, 'stddev', stddev)
        for name in ('mass', 'damping'):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise InputError(
                    f'experimental: {name} {getattr(self, name)} must be finite and not negative'
                )
        for name, sd in self.stddev.items():
            if name not in ('mass', 'damping', 'stiffness'):
                raise InputError(
                    f'experimental: no {name!r} to have a standard deviation; there are mass, '
                    'damping, stiffness'
                )
            if not 0.0 <= sd < np.inf:
                raise InputError(f'experimental: standard deviation {sd} of {name} is negative')

    @property
    def nominal(self) -> dict[str, Array]:
        """Mass, damping and stiffness, (1,) each."""
        return {n: np.array([getattr(self, n)]) for n in ('mass', 'damping', 'stiffness')}

    def drawn(self, rng: np.random.Generator, count: int) -> dict[str, Array]:
        """Return mass, damping, stiffness, (count,) each: normal, kept above zero."""
        return {
            name: np.maximum(
                rng.normal(getattr(self, name), self.stddev.get(name, 0.0), count),
                1e-3 * getattr(self, name),
            )
            for name in ('mass', 'damping', 'stiffness')
        }


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Partition:
    """A hybrid test's structure and how its loop is sampled.

    Attributes:
        mass, damping, stiffness: of the numerical substructure, without the specimen, each (n, n)
            [kg, kg/s, N/m].
        specimen: the experimental substructure.
        rate: sample rate of the loop [Hz].
        interface: degree of freedom that the actuator imposes, counted from 0.
        computation_delay: from the measured force to the command that answers it [s].
        displacement_noise, force_noise: white noise of the sensors, standard deviation [m, N].
        influence: displacement of each degree of freedom when the ground moves by one, (n,);
            ones where None is given.
        name: of the partition.
    """

    mass: Array
    damping: Array
    stiffness: Array
    specimen: Specimen
    rate: float
    interface: int = 0
    computation_delay: float = 0.0
    displacement_noise: float = 0.0
    force_noise: float = 0.0
    influence: Array | None = None
    name: str = 'partition'

    def __post_init__(self) -> None:
        take_numbers(self)
        of_kind(self.specimen, f'{self.name}: specimen', Specimen, 'a Specimen')
        for name in ('mass', 'damping', 'stiffness'):
            matrix = square(getattr(self, name), f'{self.name}: numerical {name}')
            object.__setattr__(self, name, matrix)
            if matrix.shape != np.shape(self.mass):
                raise InputError(
                    f'{self.name}: numerical {name} has shape {matrix.shape}, mass '
                    f'{np.shape(self.mass)}; both need one row a degree of freedom'
                )
        if np.linalg.eigvalsh(self.mass)[0] <= 0.0:
            raise InputError(
                f'{self.name}: the numerical mass is not positive definite; every degree of '
                'freedom needs a mass (and more than the specimen takes out of the reference)'
            )
        if not 0 <= self.interface < len(self.mass):
            raise InputError(
                f'{self.name}: interface {self.interface + 1} is none of the {len(self.mass)} '
                'degrees of freedom, counted from 1'
            )
        if not 1.0 <= self.rate <= 1e6:
            raise InputError(f'{self.name}: rate {self.rate:g} Hz is outside [1, 1e6] Hz')
        if not 0.0 <= self.computation_delay <= 1.0:
            raise InputError(
                f'{self.name}: computation_delay {self.computation_delay:g} s is outside [0, 1] s'
            )
        for name in ('displacement_noise', 'force_noise'):
            if not 0.0 <= getattr(self, name) < np.inf:
                raise InputError(f'{self.name}: {name} {getattr(self, name):g} is negative')
        moved = () if self.influence is None else np.shape(self.influence)
        if self.influence is not None and (
            moved != (len(self.mass),) or not np.isfinite(self.influence).all()
        ):
            raise InputError(
                f'{self.name}: influence has shape {moved}; give one finite number for each of '
                f'the {len(self.mass)} degrees of freedom'
            )

    def __repr__(self) -> str:
        return (
            f'Partition({self.name}: {len(self.mass)} degree(s) of freedom, {self.specimen}, '
            f'{self.rate:g} Hz)'
        )

    @property
    def period(self) -> float:
        """Sample period [s]."""
        return 1.0 / self.rate

    @property
    def load(self) -> Array:
        """Force on each degree of freedom while the ground accelerates by -1 m/s^2, (n,) [kg].

        The whole structure's: the specimen stands on ground that does not move.
        """
        moved = np.ones(len(self.mass)) if self.influence is None else self.influence
        return np.asarray(self.whole[0] @ moved)

    @property
    def whole(self) -> tuple[Array, Array, Array]:
        """Mass, damping and stiffness of the structure with the specimen, each (n, n)."""
        parts = (self.specimen.mass, self.specimen.damping, self.specimen.stiffness)
        matrices = (self.mass.copy(), self.damping.copy(), self.stiffness.copy())
        for matrix, part in zip(matrices, parts, strict=True):
            matrix[self.interface, self.interface] += part
        return matrices

    @property
    def natural_frequencies(self) -> Array:
        """Natural frequencies of the structure with the specimen, ascending, (n,) [Hz]."""
        M, _, K = self.whole
        squares = scipy.linalg.eigh(K, M, eigvals_only=True)
        return np.asarray(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi))

    def without_specimen(self) -> Partition:
        """Return the partition whose matrices are those of a reference structure, less specimen.

        The specimen's mass, damping and stiffness are subtracted at the interface, so that both
        parts together are the reference structure.
        """
        parts = (self.specimen.mass, self.specimen.damping, self.specimen.stiffness)
        out = []
        for matrix, part in zip((self.mass, self.damping, self.stiffness), parts, strict=True):
            left = matrix.copy()
            left[self.interface, self.interface] -= part
            out.append(left)
        return replace(self, mass=out[0], damping=out[1], stiffness=out[2])


def square(values: ArrayLike, name: str) -> Array:
    """Return a symmetric matrix; one number is a matrix (1, 1).

    Raises:
        InputError: not a symmetric matrix of finite numbers, or too large.
    """
    try:
        matrix = np.array(values, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f'{name} is not a matrix of numbers ({error})') from error
    if matrix.ndim == 0:
        matrix = matrix.reshape(1, 1)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or not matrix.size:
        raise InputError(f'{name} has shape {matrix.shape}; give as many rows as columns')
    if len(matrix) > _LARGEST:
        raise InputError(f'{name} has {len(matrix)} rows; condense it to at most {_LARGEST}')
    if not np.isfinite(matrix).all():
        raise InputError(f'{name} has NaN or infinite entries')
    if not np.allclose(matrix, matrix.T, rtol=1e-6, atol=1e-9 * np.abs(matrix).max()):
        raise InputError(f'{name} is not symmetric')
    return matrix


def modal_damping(mass: Array, stiffness: Array, ratio: float) -> Array:
    """Return the damping matrix with one damping ratio in every mode, (n, n) [kg/s].

    C = M Phi diag(2 zeta w) Phi^T M with mass-normalised modes Phi (Chopra, Dynamics of
    Structures, section 11.4).

    Raises:
        InputError: a ratio outside [0, 1), or a mass that is not positive definite.
    """
    if not 0.0 <= ratio < 1.0:
        raise InputError(f'damping ratio {ratio:g} is outside [0, 1); 5 % is 0.05')
    try:
        squares, modes = scipy.linalg.eigh(stiffness, mass)
    except np.linalg.LinAlgError as error:
        raise InputError(
            f'no modes to damp: the mass is not positive definite ({error})'
        ) from error
    shape = mass @ modes
    return np.asarray(shape @ np.diag(2.0 * ratio * np.sqrt(np.maximum(squares, 0.0))) @ shape.T)
