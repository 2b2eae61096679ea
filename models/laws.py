"""Damping laws: each is a small frozen dataclass that turns a block into an oscillator.

The module holds no compiled code. The provenance of each formula is stated with it: *paper* is Liu, H., Huang, Y. and
Qu, Z. (2024). A discretely damped SDOF model for the rocking response of freestanding blocks. Earthquake Engineering
and Engineering Vibration; *derived* was worked out here and is checked numerically in the tests; *recalled* is known
from the literature but was not re-read.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import MISSING, dataclass, field, fields, replace
from typing import Annotated, Any, ClassVar

from ..core import checks
from ..core.parameters import PART, Parameter, check
from ..core.units import STANDARD_GRAVITY
from .assembly import Zone, assemble
from .block import Block
from .engine import tables as engine
from .oscillator import Oscillator
from .sides import check_zone, sides, surroundings, with_bed_damping, zone_of
from .supports import MOST_DELTA

LEVERS = ("h", "R")
RESTS = ("elastic", "rigid", "soft")
GEOMETRIES = ("exact", "linear", "bilinear")
MIN_DELTA = 1e-9
"""Minimum half width of the elastic zone over alpha: the zone's frequency grows as delta^-½, and so does the work."""
MOST_PIECES = engine.MOST_PIECES // 2
"""Maximum number of pieces of a run whose block always rests in its elastic zone: half of the engine's limit, about 0.8
s.
"""
MAX_DAMPING = 100.0
"""Largest damping ratio (and coefficient of Vassiliou's law): beyond any physical value, where the zone gets stiff."""


class Model(ABC):
    """Model of a block on a moving floor, as a frozen dataclass of options: a damping law of rocking, or sliding.

    `law` is the short name in labels and study files.
    """

    law: ClassVar[str]

    def restitution(self, block: Block) -> float | None:
        """Return the coefficient of restitution used for `block`, or None if the model has none.

        It is the model's own e or, if e is not given, Housner's e_R of the block times `restitution_factor`.  The value
        is never clipped: a value above 1 is an error.
        """
        return None

    @property
    def options(self) -> dict[str, Any]:
        """All options by name."""
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    @property
    @abstractmethod
    def label(self) -> str:
        """Short name and options as people read them, different for different options."""


RESTITUTION = PART
DELTA = Parameter(at_least=MIN_DELTA, below=1.0)
USUAL_DELTA = 0.05
"""Recommendation of the paper."""
USUAL_LEVER = "h"
Restitution = Annotated[float, RESTITUTION]
Factor = Annotated[float, Parameter(above=0.0)]
Delta = Annotated[float, DELTA]
Damping = Annotated[float, Parameter(at_least=0.0, at_most=MAX_DAMPING)]
Lever = Annotated[str, Parameter(words=LEVERS)]
Rest = Annotated[str, Parameter(words=RESTS)]


class Law(Model):
    """Damping law: the way in which a rocking block dissipates energy.

    The engine only calls `oscillator(block)`.  A new law that uses an existing rule of the engine is one dataclass.

    Parameters
    ----------
    e : float, optional
        Coefficient of restitution; the block's own e_R = 1 - (2/λ) sin²α times `restitution_factor` if not given.
    restitution_factor : float
        Factor on e_R if e is not given.
    delta : float
        Half width of the elastic zone over alpha; 0.05 is the paper's recommendation.
    zeta : float
        Damping ratio, 0.05 for 5 %.
    coefficient : float
        Coefficient of the law of Vassiliou et al.
    lever : {"h", "R"}
        Lever arm of the acceleration: the mass centre's height, or R.
    rest : {"elastic", "rigid", "soft"}
        Kind of rest; `soft` is elastic on a support of measured softness.
    geometry : {"exact", "linear", "bilinear"}
        Housner's geometry.
    """

    def __post_init__(self) -> None:
        """Validate the options that laws share, once, when the law is made."""
        check(self)
        values = self.options
        if values.get("e") is not None and values.get("restitution_factor", 1.0) != 1.0:
            raise ValueError(
                f"restitution_factor is a factor on e_R: give it or e, got e={values['e']:g} and "
                f"restitution_factor={values['restitution_factor']:g}"
            )
        if values.get("rest") == "soft" and values["delta"] > MOST_DELTA:
            raise ValueError(f"delta must be at most {MOST_DELTA:g} with rest='soft', got {values['delta']:g}")

    @abstractmethod
    def oscillator(self, block: Block) -> Oscillator:
        """Return the oscillator of `block` under this law; ValueError if the block needs an explicit e."""

    def zone_edge(self, block: Block) -> float:
        """Return the rotation up to which `block` is in an elastic zone, rad: delta alpha, or that at which a bed ends.

        0 of a law without an elastic zone.
        """
        if "delta" not in self.options:
            return 0.0
        return self.options["delta"] * block.alpha if block.bed is None else block.bed.settlement / block.b

    @property
    def label(self) -> str:
        """Short name, e, delta and every option that is not the default, as ``discrete e=0.92 δ=0.05 rest=rigid``."""
        parts = [self.law]
        values = self.options
        defaults = {f.name: f.default for f in fields(self)}  # type: ignore[arg-type]
        if "e" in values:
            factor = values.get("restitution_factor", 1.0)
            restitution = "e_R" if factor == 1.0 else f"{factor:g}·e_R"
            parts.append(f"e={restitution}" if values["e"] is None else f"e={values['e']:g}")
        if "zeta" in values:
            parts.append(f"ζ={values['zeta']:g}")
        if "delta" in values:
            parts.append(f"δ={values['delta']:g}")
        for name in ("coefficient", "geometry", "lever", "rest"):
            if name in values and values[name] != defaults[name] and defaults[name] is not MISSING:
                value = values[name]
                parts.append(f"{name}={value if isinstance(value, str) else format(value, 'g')}")
        return " ".join(parts)


class _ImpactLaw(Law):
    """Law with a coefficient of restitution; its fields are `e` and `restitution_factor`."""

    e: Restitution | None
    restitution_factor: float

    def restitution(self, block: Block) -> float:
        if self.e is not None:
            return self.e
        value = self.restitution_factor * block.restitution
        if value > 1.0:
            factor = self.restitution_factor
            raise ValueError(f"restitution_factor {factor:g} times e_R {block.restitution:.4g} is {value:.4g}: above 1")
        return value


def viscous(block: Block, law: Law, delta: float, lever: str, ratio: float) -> Oscillator:
    """Return the oscillator with the damping moment 2 ratio sqrt(I_O k0) theta', the same at every rotation.

    On a bed, k0 is its stiffness in full contact, and the moment falls with the width in contact.
    """
    zone = zone_of(block, delta, lever, rigid_rest=False)
    damping = 2.0 * ratio * math.sqrt(zone.stiffness)
    front, back = sides(block, "bilinear", lever)
    if block.bed is not None:
        return _bilinear(block, law, lever, with_bed_damping(zone, damping))
    zone = zone._replace(
        damping=damping,
        front_damping=damping * (zone.inertia / front.inertia),
        back_damping=damping * (zone.inertia / back.inertia),
    )
    return _bilinear(block, law, lever, zone)


def _refuse_bed(block: Block, law: Law, why: str) -> None:
    if block.bed is not None:
        raise ValueError(
            f"law {law.law!r} cannot have {block.label!r}, which stands on a bed: {why}; take viscous with a measured "
            "zeta, or discrete or energy-consistent with rest='soft'"
        )


def _bilinear(block: Block, law: Law, lever: str, zone: Zone, e: float = 1.0) -> Oscillator:
    """Return the oscillator with falling branches, an elastic zone between them, and the block's surroundings."""
    front, back = sides(block, "bilinear", lever)
    around = surroundings(block, front, back, exact=False)
    check_zone(block, zone, around, type(law).__name__)
    return assemble(front, back, e, zone, around)


class _HeldZoneLaw(_ImpactLaw):
    """Law whose zone damping is set at each entry by the engine's rule `rule` and held until the next entry."""

    rule: ClassVar[int]
    delta: float
    lever: str
    rest: str

    def oscillator(self, block: Block) -> Oscillator:
        e = self.restitution(block)
        zone = zone_of(block, self.delta, self.lever, self.rest == "rigid")
        coefficient = 0.0
        if self.rule == engine.RULE_ENTRY_SPEED:
            coefficient = (1.0 - e) / (zone.front + zone.back)
        elif block.bed is not None:  # the potential at the zone's edge
            coefficient = 0.5 * zone.stiffness * zone.front**2
        elif block.symmetric:
            front, _ = sides(block, "bilinear", self.lever)
            coefficient = front.q2 * zone.front * (front.alpha - 0.5 * zone.front)
        return _bilinear(block, self, self.lever, zone._replace(rule=self.rule, coefficient=coefficient), e)


@dataclass(frozen=True)
class DiscreteDamping(_HeldZoneLaw):
    """The paper's own law: damping force f_d = c_D theta' inside |theta| <= delta alpha, none outside.

    c_D = c' |theta'_in| with c' = I_O (1 - e)/(2 delta alpha) (paper, Eqs. 15-17). Here theta'_in is the velocity at
    the last inward crossing of |theta| = delta alpha. The next inward crossing changes c_D; before the first one the
    zone is undamped.

    Parameters
    ----------
    e : float, optional
        Coefficient of restitution; the block's own e_R = 1 - (2/λ) sin²α times `restitution_factor` if not given.
    delta : float
        Half width of the elastic zone over alpha; 0.05 is the paper's recommendation.
    lever : {"h", "R"}
        Lever arm of the acceleration: the mass centre's height (threshold g tan alpha) or R (the paper's lumped mass,
        threshold g sin alpha).
    rest : {"elastic", "rigid", "soft"}
        "elastic": the block at rest is in the elastic zone, as in the paper. "rigid": it stays at rest until the static
        threshold is exceeded (derived). "soft": as "elastic", on a soft support whose settlement or frequency was
        measured and gives delta (`delta_from_settlement`, `delta_from_frequency`; at most 0.3). The elastic mode is
        then the support's and no artefact of delta, and notes state this.

    Notes
    -----
    A block on a bed (`Bed`) has the bed's zone, up to its uplift, whatever delta is; "rigid" is an error. The rule is
    the same: each inward crossing of the bed in full contact takes about the share 1 - e of the velocity. The bed is
    undamped before the first one. e is nominal then.
    """

    law: ClassVar[str] = "discrete"
    rule: ClassVar[int] = engine.RULE_ENTRY_SPEED
    e: Restitution | None = None
    delta: Delta = USUAL_DELTA
    lever: Lever = USUAL_LEVER
    rest: Rest = "elastic"
    restitution_factor: Factor = field(default=1.0, kw_only=True)


@dataclass(frozen=True)
class EnergyConsistent(_HeldZoneLaw):
    """Discrete damping whose c_D makes the zone dissipate exactly the energy of an impact with e (derived).

    c >= 0 is the root for which the unforced crossing leaves the zone with v_o² = e² v_i² - (1 - e²) s (2 delta -
    delta²). Here v = theta'/(p alpha) and s = sin(alpha)/alpha. Free rocking then has Housner's peaks for every delta.
    If v_o² <= 0, ``rest="rigid"`` keeps the block on the rigid branch, and ``rest="elastic"`` takes the c that just
    stops the block at the far edge. The options are as for `DiscreteDamping`.

    On a bed (`Bed`) each crossing of full contact leaves e² of the energy above the energy of the block at rest
    (derived). There is no rigid block whose impact could be matched, because the bed deforms at every rotation.
    """

    law: ClassVar[str] = "energy-consistent"
    rule: ClassVar[int] = engine.RULE_ENERGY
    e: Restitution | None = None
    delta: Delta = USUAL_DELTA
    lever: Lever = USUAL_LEVER
    rest: Rest = "rigid"
    restitution_factor: Factor = field(default=1.0, kw_only=True)


@dataclass(frozen=True)
class _RestitutionViscous(_ImpactLaw):
    """Initial-stiffness proportional damping f_d = 2 zeta(e) sqrt(I_O k0) theta' at every rotation (paper, Eq. 11)."""

    e: Restitution | None = None
    delta: Delta = USUAL_DELTA
    lever: Lever = USUAL_LEVER
    restitution_factor: Factor = field(default=1.0, kw_only=True)

    @staticmethod
    @abstractmethod
    def damping_ratio(e: float) -> float:
        """Return the damping ratio zeta for the coefficient of restitution e."""

    def oscillator(self, block: Block) -> Oscillator:
        _refuse_bed(block, self, "its damping ratio is that of impacts on a rigid floor")
        return viscous(block, self, self.delta, self.lever, self.damping_ratio(self.restitution(block)))


@dataclass(frozen=True)
class GianniniMasiani(_RestitutionViscous):
    """Continuous viscous damping with zeta = (2/pi)(1 - e)/(1 + e).

    The form is derived: zero for e = 1 and 2/pi for e = 0, as the paper states. The damping coefficient c = 2 zeta
    sqrt(I_O k0) is the paper's. The options `e`, `delta` and `lever` are as for `DiscreteDamping`.

    References
    ----------
    Giannini, R. and Masiani, R. (1990). Risposta in frequenza del blocco rigido. (Cited by the paper; not re-read.)
    """

    law: ClassVar[str] = "giannini-masiani"

    @staticmethod
    def damping_ratio(e: float) -> float:
        return 2.0 / math.pi * (1.0 - e) / (1.0 + e)


@dataclass(frozen=True)
class MakrisKonstantinidis(_RestitutionViscous):
    """Continuous viscous damping with zeta = -0.68 ln e.

    The authors fitted the formula to an oscillator of amplitude-dependent period; with the initial stiffness, as in the
    paper, it over-damps. The options `e`, `delta` and `lever` are as for `DiscreteDamping`.

    References
    ----------
    Makris, N. and Konstantinidis, D. (2003). The rocking spectrum and the limitations of practical design
    methodologies. Earthquake Engineering and Structural Dynamics 32, 265-289, Eq. 11 (-0.34 ln e²).
    """

    law: ClassVar[str] = "makris-konstantinidis"

    @staticmethod
    def damping_ratio(e: float) -> float:
        return -0.68 * math.log(e)


@dataclass(frozen=True)
class Vassiliou(Law):
    """Continuous viscous damping c = coefficient (alpha/0.1)² m g^½ R^(3/2), independent of e and delta.

    The coefficient 0.02 is recalled and is therefore a parameter (>= 0).

    References
    ----------
    Vassiliou, M. F., Mackie, K. R. and Stojadinović, B. (2014). Dynamic response analysis of solitary flexible rocking
    bodies: modeling and behavior under pulse-like ground excitation. Earthquake Engineering and Structural Dynamics 43.
    """

    law: ClassVar[str] = "vassiliou"
    delta: Delta = USUAL_DELTA
    coefficient: Damping = 0.02
    lever: Lever = USUAL_LEVER

    def oscillator(self, block: Block) -> Oscillator:
        _refuse_bed(block, self, "its damping is that of rocking on a rigid floor")
        zone = zone_of(block, self.delta, self.lever, rigid_rest=False)
        front, back = (
            self.coefficient * (alpha / 0.1) ** 2 * math.sqrt(STANDARD_GRAVITY) * math.hypot(half, block.h) ** 1.5
            for half, alpha in block.corners
        )
        of_front, of_back = sides(block, "bilinear", self.lever)
        zone = zone._replace(
            damping=0.5 * (front + back) / zone.inertia,
            front_damping=front / of_front.inertia,
            back_damping=back / of_back.inertia,
        )
        return _bilinear(block, self, self.lever, zone)


@dataclass(frozen=True)
class ViscousDamping(Law):
    """Continuous viscous damping c = 2 zeta sqrt(I_O k0), with any ratio `zeta` >= 0 of the initial stiffness.

    On a bed (`Bed`) zeta is the damping ratio of rocking before uplift, k0 the stiffness of full contact, and delta is
    not used. The damping is from the bed's material. It is c (theta_u/theta)^(3/2) beyond the rotation theta_u at
    uplift, because the contact narrows (derived), and constant over each straight piece of its moment.
    """

    law: ClassVar[str] = "viscous"
    zeta: Damping
    delta: Delta = USUAL_DELTA
    lever: Lever = USUAL_LEVER

    @classmethod
    def fema356(cls, e: float, delta: float = USUAL_DELTA, lever: str = USUAL_LEVER) -> "ViscousDamping":
        """Return the law with FEMA 356's zeta = 0.4 (1 - e), as quoted by Makris and Konstantinidis (2003)."""
        return cls(0.4 * (1.0 - PART.number("e", e)), delta, lever)

    def oscillator(self, block: Block) -> Oscillator:
        return viscous(block, self, self.delta, self.lever, self.zeta)


@dataclass(frozen=True)
class HousnerImpact(_ImpactLaw):
    """Housner's rigid block, the reference of the field: theta' -> e theta' at each impact, rest below a threshold.

    Parameters
    ----------
    e : float, optional
        Coefficient of restitution; the block's own e_R times `restitution_factor` if not given.
    geometry : {"exact", "linear", "bilinear"}
        ``exact``: theta'' = -p² (sin(alpha sgn theta - theta) + (u''/g) cos(alpha sgn theta - theta)), threshold g tan
        alpha. ``linear``: theta'' = p² (theta - alpha sgn theta - u''/g), threshold g alpha. ``bilinear``: the delta ->
        0 limit of the single-degree-of-freedom laws, with p² sin(alpha)/alpha and their lever arm.
    lever : {"h", "R"}
        Lever arm of the acceleration, for ``bilinear`` only.

    References
    ----------
    Housner (1963), as in `Block`; exact form: Zhang, J. and Makris, N. (2001). Rocking response of free-standing
    blocks under cycloidal pulses. Journal of Engineering Mechanics 127(5), 473-483, Eq. 12.
    """

    law: ClassVar[str] = "housner"
    e: Restitution | None = None
    geometry: Annotated[str, Parameter(words=GEOMETRIES)] = "exact"
    lever: Lever = USUAL_LEVER
    restitution_factor: Factor = field(default=1.0, kw_only=True)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.lever != USUAL_LEVER and self.geometry != "bilinear":
            raise ValueError(f"lever={self.lever!r} needs geometry='bilinear', got geometry={self.geometry!r}")

    def oscillator(self, block: Block) -> Oscillator:
        _refuse_bed(block, self, "its impacts are those on a rigid floor")
        front, back = sides(block, self.geometry, self.lever)
        exact = self.geometry == "exact"
        around = surroundings(block, front, back, exact)
        if exact and around.restrained:
            raise ValueError(
                f'a restraint needs linearised geometry: for {block.label!r} take the law "housner" '
                '(HousnerImpact) with geometry = "linear" or "bilinear"'
            )
        return assemble(front, back, self.restitution(block), None, around, exact=exact)


LAWS: dict[str, type[Law]] = {
    law.law: law
    for law in (
        DiscreteDamping,
        GianniniMasiani,
        MakrisKonstantinidis,
        Vassiliou,
        ViscousDamping,
        EnergyConsistent,
        HousnerImpact,
    )
}
"""The laws by the short names that study files and labels use."""


def oscillator_of(block: Any, model: Any) -> Oscillator:
    """Return the oscillator of a block under a law; TypeError if either argument is of another type."""
    if not isinstance(block, Block):
        raise TypeError(f"block must be a toppling Block, got {checks.kind(block)}")
    if not isinstance(model, Law):
        raise TypeError(f"model must be a damping law such as DiscreteDamping(), got {checks.kind(model)}")
    oscillator = model.oscillator(block)
    return oscillator if block.tilt_limit is None else oscillator._replace(limit=block.tilt_limit)


def refuse_endless(block: Block, law: Model, seconds: float) -> None:
    """Raise ValueError for an elastic zone that is too stiff to be followed through a motion of `seconds`.

    Its pieces are two for each time constant (`Oscillator.pieces`).  Its stiffness is about q²/delta, and the damping
    of a ratio zeta is 2 zeta times the root of that: they grow as delta^-½.  Measured, of 2 m × 19.5 m and delta from
    1e-4 to 1e-9 under the viscous laws: 1.0e-7 to 1.9e-7 s for each piece.
    """
    if not isinstance(law, Law) or (pieces := law.oscillator(block).pieces(seconds)) <= MOST_PIECES:
        return
    does = "take a smaller damping" if block.bed is None else "take a bed that settles more"
    for margin in () if block.bed is not None else (1.1, 2.0, 10.0):  # (a given damping does not fall with delta)
        delta = float(f"{margin * law.options['delta'] * (pieces / MOST_PIECES) ** 2:.1e}")
        # (every law with a zone is a dataclass with a delta)
        if delta < 1.0 and replace(law, delta=delta).oscillator(block).pieces(seconds) <= MOST_PIECES:  # type: ignore[type-var]
            does = f"delta must be at least {delta:g}"
            break
    raise ValueError(
        f"{block.label!r} under {law.label}: its elastic zone is too stiff for motions of {seconds:.4g} s (some "
        f"{pieces:.1g} pieces to solve for each run, at most {MOST_PIECES:.0e}); {does}"
    )


def describe_law(model: Model) -> dict[str, Any]:
    """Return the model's short name and all options, as plain values."""
    return {"law": model.law, **model.options}
