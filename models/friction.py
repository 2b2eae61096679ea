"""Friction: the coefficient that a block needs to rock without sliding, and the coefficient that a floor has.

The needed coefficient follows from the block, its floor motion and its restitution alone; the laws of rocking do not
include friction. The coefficient of the floor is a number or a distribution: `below(need)` is the probability that it
does not suffice.
"""

from abc import ABC, abstractmethod
from dataclasses import asdict, dataclass
from numbers import Real
from typing import Annotated, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core import checks
from ..core.aliases import Array, Flags
from ..core.distributions import Lognormal
from ..core.parameters import PART, Parameter, check
from ..core.units import STANDARD_GRAVITY
from .block import UNIFORM_INERTIA_FACTOR


def friction_at_uplift(
    slenderness: ArrayLike, acceleration: ArrayLike | None = None, inertia_factor: ArrayLike = UNIFORM_INERTIA_FACTOR
) -> Array:
    """Return the coefficient of friction that keeps a block at rest from sliding, up to uplift and right after it.

    Parameters
    ----------
    slenderness : array_like
        h/b: height of the centre of mass over the half width, > 0.
    acceleration : array_like, optional
        Floor acceleration of the upright block, m/s² (its sign does not matter); if not given, the acceleration that
        just lifts the block, g b/h.
    inertia_factor : array_like
        lambda = I_O/(m R²), > 1.  All three broadcast.

    Returns
    -------
    numpy.ndarray
        Dimensionless: |a|/g if |a|/g is below b/h (the block moves with the floor), b/h at uplift. Above it, it is the
        coefficient that the rocking block needs while its rotation is still small.

    Notes
    -----
    Let a = |u''|/g and gamma = h/b. Rotation about the corner with theta'' = g (a h - b)/(lambda R²) needs a horizontal
    force m (a g - h theta''). The vertical force is m (g + b theta''), hence

        mu >= [a (lambda (1 + gamma²) - gamma²) + gamma]/[lambda (1 + gamma²) - 1 + a gamma],

    Shenton's [a (4 + gamma²) + 3 gamma]/[3 a gamma + 1 + 4 gamma²] for lambda = 4/3 (general lambda: derived).  It
    grows with a from b/h at a = b/h towards (lambda (1 + gamma²) - gamma²)/gamma.  A continuous acceleration passes
    b/h, where b/h suffices, and reaches its peak when the block has turned by a small angle: the formula holds for the
    peak, too.

    References
    ----------
    Shenton, H. W. (1996). Criteria for initiation of slide, rock, and slide-rock rigid-body modes. Journal of
    Engineering Mechanics 122(7), 690-693.  Zhang, J. and Makris, N. (2001). Rocking response of free-standing blocks
    under cycloidal pulses. Journal of Engineering Mechanics 127(5), 473-483, Eq. 7.

    Examples
    --------
    >>> bool(friction_at_uplift(5.0) == 0.2), round(float(friction_at_uplift(1.6, 9.80665)), 3)
    (True, 0.708)
    """
    gamma = np.asarray(slenderness, dtype=float)
    _check_all("slenderness", gamma, gamma > 0.0, "> 0")
    if acceleration is None:
        return np.asarray(1.0 / gamma)
    inertia = np.asarray(inertia_factor, dtype=float)
    _check_all("inertia_factor", inertia, inertia > 1.0, "> 1")
    a = np.abs(np.asarray(acceleration, dtype=float)) / STANDARD_GRAVITY
    _check_all("acceleration", a, np.isfinite(a), "finite")
    about = inertia * (1.0 + gamma**2)
    rocking = (a * (about - gamma**2) + gamma) / (about - 1.0 + a * gamma)
    return np.asarray(np.where(a * gamma <= 1.0, a, rocking))


def friction_at_impact(slenderness: ArrayLike, e: ArrayLike) -> Array:
    """Return the coefficient of friction that keeps a block from sliding in an impact with restitution e.

    Parameters
    ----------
    slenderness : array_like
        h/b, > 0.
    e : array_like
        Coefficient of restitution, 0 <= e <= 1; NaN (a law without one) gives NaN.  Both broadcast.

    Returns
    -------
    numpy.ndarray
        (h/b) (1 - e)/(1 + e), dimensionless.

    Notes
    -----
    The centre of mass has the velocity (h, -b) theta' before the impact and (h, b) e theta' after it. The impulse is (1
    - e) h across and (1 + e) b upward, at any point of action and for any inertia (derived). A slender block with a
    small e needs friction that no floor has.

    Examples
    --------
    >>> round(float(friction_at_impact(5.0, 0.5)), 3)
    1.667
    """
    gamma = np.asarray(slenderness, dtype=float)
    restitution = np.asarray(e, dtype=float)
    _check_all("slenderness", gamma, gamma > 0.0, "> 0")
    _check_all("e", restitution, np.isnan(restitution) | ((restitution >= 0.0) & (restitution <= 1.0)), ">= 0 and <= 1")
    return np.asarray(gamma * (1.0 - restitution) / (1.0 + restitution))


class Friction(ABC):
    """Coefficient of friction between a block and its floor, known or random."""

    distribution: ClassVar[str]

    @abstractmethod
    def below(self, need: ArrayLike) -> Array:
        """Return the probability that the coefficient is below `need` (>= 0); NaN if `need` is NaN."""

    @abstractmethod
    def quantile(self, probability: Array) -> Array:
        """Return the coefficients at probabilities between 0 and 1, in the same shape."""

    @property
    def description(self) -> dict[str, Any]:
        """The distribution and its parameters, as plain values."""
        return {"distribution": self.distribution, **asdict(self)}  # type: ignore[call-overload]


MOST_FRICTION = 10.0
"""Largest coefficient of friction, beyond any contact's: 40 is per cent; blocks of 10 do not slide."""
STATIC = Parameter(above=0.0, at_most=MOST_FRICTION)
SPREAD = Parameter(above=0.0)
"""Dispersion of a coefficient of friction."""


@dataclass(frozen=True)
class FixedFriction(Friction):
    """Known coefficient of friction, > 0 and at most 10."""

    distribution: ClassVar[str] = "fixed"
    value: float

    def __post_init__(self) -> None:
        STATIC.number("friction", self.value)

    def below(self, need: ArrayLike) -> Array:
        wanted = np.asarray(need, dtype=float)
        return np.where(np.isnan(wanted), np.nan, self.value < wanted)

    def quantile(self, probability: Array) -> Array:
        return np.full(np.shape(probability), self.value)


@dataclass(frozen=True)
class LognormalFriction(Friction):
    """Lognormal coefficient of friction: median > 0, dispersion (standard deviation of its logarithm) > 0.

    Examples
    --------
    >>> float(LognormalFriction(0.5, 0.3).below(0.5))
    0.5
    """

    distribution: ClassVar[str] = "lognormal"
    median: float
    dispersion: float

    def __post_init__(self) -> None:
        STATIC.number("median of friction", self.median)
        SPREAD.number("dispersion of friction", self.dispersion)

    def below(self, need: ArrayLike) -> Array:
        return Lognormal(self.median, self.dispersion).below(need)

    def quantile(self, probability: Array) -> Array:
        return Lognormal(self.median, self.dispersion).quantile(probability)


@dataclass(frozen=True)
class Contact:
    """Contact of a piece with its floor: friction, and kinetic over static friction, > 0 and at most 1."""

    friction: Friction
    kinetic_ratio: Annotated[float, PART] = 1.0

    def __post_init__(self) -> None:
        if not isinstance(self.friction, Friction):
            raise TypeError(f"friction of a contact must be a Friction, got {checks.kind(self.friction)}")
        check(self)


@dataclass(frozen=True)
class _ListedContact(Contact):
    """Contact of `CONTACTS`, with its description."""

    friction: LognormalFriction
    text: str = ""


CONTACTS: dict[str, _ListedContact] = {
    "vinyl": _ListedContact(
        LognormalFriction(0.35, 0.30),
        0.85,
        "smooth feet of plastic or metal on vinyl, linoleum, tiles, laminate or a bench top",
    ),
    "rubber feet": _ListedContact(LognormalFriction(0.75, 0.25), 0.9, "rubber feet on the same floors"),
    "carpet": _ListedContact(LognormalFriction(0.55, 0.30), 0.9, "carpet"),
    "concrete": _ListedContact(LognormalFriction(0.50, 0.25), 0.9, "steel on concrete"),
}
"""Contacts by name. The values are assumed: tests span 0.2 to 0.8, and no medians were found."""
ROLLING, LOCKED = "castors", "castors locked"
"""Contact without friction to keep a piece in place, and contact with the friction of brakes, which is not listed."""
UNLOCKED = "castors unlocked"
"""The same as `ROLLING`."""


def contact_named(name: str) -> _ListedContact:
    """Return a contact; ValueError for an unknown one, and for castors, which roll or have the friction of brakes."""
    if name in (ROLLING, UNLOCKED):
        raise ValueError("a piece on castors rolls, which is not modelled: lock or block them and name that contact")
    if name == LOCKED:
        raise ValueError("the friction of locked castors is not listed: give it as a number")
    return CONTACTS[checks.choice("contact", name, tuple(CONTACTS))]


def friction_and_ratio(contact: str | None, static: Any, dispersion: float | None) -> tuple[Friction, float | None]:
    """Return the friction of a contact and its kinetic over static friction; without a contact None as ratio.

    The friction is then the known coefficient `static`, or lognormal with that median if there is a dispersion.
    """
    if contact is not None:
        known = contact_named(contact)
        return known.friction, known.kinetic_ratio
    return FixedFriction(static) if dispersion is None else LognormalFriction(static, dispersion), None


def contact_of(value: Any) -> Contact:
    """Return a number or a `Friction` as a contact, and a contact unchanged; TypeError for anything else."""
    if isinstance(value, Contact):
        return value
    if isinstance(value, Friction):
        return Contact(value)
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"friction must be a number or a Friction such as LognormalFriction, got {checks.kind(value)}")
    return Contact(FixedFriction(float(value)))


def _check_all(name: str, values: NDArray[Any], holds: Flags, allowed: str) -> None:
    if not np.all(holds):
        raise ValueError(f"{name} must be {allowed}, got {np.ravel(values)[np.argmin(np.ravel(holds))]:g}")
