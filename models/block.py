"""The block: Housner's parameters from its sizes, and its surroundings and restraint."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Annotated, Any

from ..core import checks
from ..core.parameters import Parameter, check
from ..core.units import STANDARD_GRAVITY
from .scenes.bed import Bed, balance_on_bed, check_bed
from .scenes.edge import Edge
from .scenes.restraint import Restraint
from .scenes.wall import Wall

UNIFORM_INERTIA_FACTOR = 4.0 / 3.0
MIN_SIZE, MIN_ANGLE = 1e-6, 1e-6
SIZE = Parameter("m", above=0.0, at_most=1e6)
SLENDERNESS, HALF_DIAGONAL = Parameter("rad", above=0.0, below=0.5 * math.pi), Parameter("m", above=0.0)
FACTOR = Parameter(above=1.0, at_most=2.0)
TILT = Parameter("rad", above=0.0, below=0.5 * math.pi, written="°")
Size = Annotated[float, SIZE]

WIDEST = 1.5
"""m: furniture and equipment are narrower; no piece of the catalogue is wider than 0.9 m."""
WIDTHS, HEIGHTS, RATIOS = (0.05, WIDEST), (0.1, 4.0), (1.0, 12.0)
"""Plausible widths, m, heights, m, and heights over widths; the catalogue's are 0.13-0.9, 0.23-2.4 and 1.04-8.5."""
LEAST_FURNITURE = 0.6
"""Minimum height, m, of sizes that are given in feet or inches (assumed)."""
FACTORS, UNITS_OF_LENGTH = (10.0, 100.0, 1000.0), {"feet": 0.3048, "inches": 0.0254}
PARTS: dict[str, Any] = {"wall": Wall, "restraint": Restraint, "bed": Bed, "edge": Edge}
"""Surroundings and restraint of a block, by the names of its fields."""


@dataclass(frozen=True, slots=True)
class Block:
    """Rigid block on a rigid floor or a soft bed, freestanding unless it has a wall or a restraint.

    Parameters
    ----------
    width : float
        Full outer size in the direction in which it tips (2b), m: of a bookcase its depth.
    height : float
        Full outer height (2h for a uniform block), m.
    cm_height : float, optional
        Height of the centre of mass above the floor, m; mid-height if not given.
    inertia_factor : float, optional
        lambda = I_O/(m R²); 4/3 (a uniform rectangle) if not given. It must be given if the centre of mass is not at
        mid-height, because it then depends on the distribution of the mass.
    name : str, optional
        Label in results.
    mass : float, optional
        Mass, kg; only restraints use it, and need it.
    cm_offset : float
        Distance of the centre of mass in front of the middle (behind it: negative), m, less than half the width.
    lean : float
        Lean of the block or slope of the floor to the front (back: negative), rad, below the angle at which it falls.
    wall : Wall, optional
        A wall behind the block.
    restraint : Restraint, optional
        A strap, bracket, cable, pole, tendon or adhesive that holds it.
    bed : Bed, optional
        A soft bed under its whole width; only for symmetric blocks without a restraint.
    depth : float, optional
        Full outer size in the other horizontal direction, m, at least the width; needed only if both horizontal
        components act (`across`).
    round : bool
        True for a round base (a vase, a bottle): the depth is then the width, and the planar result may be
        unconservative.
    tilt_limit : float, optional
        Rotation that counts as overturning although the block may return, rad: an open vessel spills, a door opens.
    edge : Edge, optional
        The edge of a shelf, bench or pedestal, over which the block falls if it slides far enough; only for
        free-standing symmetric blocks on a rigid surface. Rocking does not depend on it.

    Notes
    -----
    The front is the side of positive rotation, away from a wall. Symbols alpha, R, p and e_R are of the block with its
    mass in the middle and without lean. The inertia factor is of this block, too. With a radius of gyration rho, rho² =
    (lambda - 1) R², the moment of inertia about a corner at the distance b is m (rho² + h² + b²).

    With h the height of the centre of mass, R = sqrt(b² + h²) and alpha = atan(b/h). The frequency is p =
    sqrt(g/(lambda R)), sqrt(3g/4R) for a uniform rectangle. The restitution is e_R = 1 - (2/lambda) sin² alpha,
    Housner's 1 - 1.5 sin² alpha for lambda = 4/3. No mass of a body inside the rectangle lies further from its centre
    than R, so that lambda <= 2.

    References
    ----------
    Housner, G. W. (1963). The behavior of inverted pendulum structures during earthquakes. Bulletin of the
    Seismological Society of America 53(2), 403-417.

    Examples
    --------
    >>> block = Block(width=0.40, height=1.80)
    >>> round(block.alpha, 4), round(block.R, 4), round(block.p, 4)
    (0.2187, 0.922, 2.8245)
    """

    width: Size
    height: Size
    cm_height: Annotated[float, Parameter("m", above=0.0)] | None = None
    inertia_factor: Annotated[float, FACTOR] | None = None
    name: str | None = None
    mass: Annotated[float, Parameter("kg", above=0.0)] | None = field(default=None, kw_only=True)
    cm_offset: Annotated[float, Parameter("m", written="mm")] = field(default=0.0, kw_only=True)
    lean: Annotated[float, Parameter("rad", written="°")] = field(default=0.0, kw_only=True)
    wall: Wall | None = field(default=None, kw_only=True)
    restraint: Restraint | None = field(default=None, kw_only=True)
    bed: Bed | None = field(default=None, kw_only=True)
    depth: Size | None = field(default=None, kw_only=True)
    round: Annotated[bool, Parameter()] = field(default=False, kw_only=True)
    tilt_limit: Annotated[float, TILT] | None = field(default=None, kw_only=True)
    edge: Edge | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check(self)
        width, height = float(self.width), float(self.height)
        middle = 0.5 * height
        cm_height = middle
        if self.cm_height is not None:
            cm_height = checks.number("cm_height", self.cm_height, below=height, unit="m")
        factor = UNIFORM_INERTIA_FACTOR
        if self.inertia_factor is not None:
            factor = float(self.inertia_factor)
        elif not math.isclose(cm_height, middle, rel_tol=1e-9):
            raise ValueError(
                f"inertia_factor must be given (1 < inertia_factor <= 2) where cm_height ({cm_height:g} m) is not "
                f"mid-height ({middle:g} m): it depends on how the mass is spread"
            )
        if self.name is not None and (not isinstance(self.name, str) or not self.name.strip()):
            raise ValueError(f"name must be a non-empty string or None, got {self.name!r}")
        alpha = math.atan2(0.5 * width, cm_height)
        if not MIN_ANGLE <= alpha <= 0.5 * math.pi - MIN_ANGLE or math.hypot(0.5 * width, cm_height) < MIN_SIZE:
            raise ValueError(
                f"a block must have alpha between {MIN_ANGLE:g} and pi/2 - {MIN_ANGLE:g} rad and R of at least "
                f"{MIN_SIZE:g} m, got {alpha:g} rad from width {width:g} m and a centre of mass at {cm_height:g} m"
            )
        object.__setattr__(self, "width", width)
        object.__setattr__(self, "height", height)
        object.__setattr__(self, "cm_height", cm_height)
        object.__setattr__(self, "inertia_factor", factor)
        self._check_plan()
        self._check_stance()
        for name, part in PARTS.items():
            given = getattr(self, name)
            if given is not None and not isinstance(given, part):
                raise TypeError(f"{name} must be a toppling {part.__name__}, got {checks.kind(given)}")
        self._check_surroundings()

    def _check_plan(self) -> None:
        """Check the plan, and set the depth of a round block."""
        if self.depth is not None:
            depth = float(self.depth)
            object.__setattr__(self, "depth", depth)
            if depth < self.width:
                raise ValueError(
                    f"depth must be at least the width, {self.width:g} m: the width is the smaller size in plan, in "
                    f"whose direction the block tips first, got {depth:g} m"
                )
            if self.round and depth != self.width:
                raise ValueError(
                    f"a round block has one size in plan, got width {self.width:g} m and depth {depth:g} m"
                )
        elif self.round:
            object.__setattr__(self, "depth", self.width)

    def _check_stance(self) -> None:
        """Raise for an offset or a lean that the block cannot have."""
        checks.number("cm_offset", self.cm_offset, above=-self.b, below=self.b, unit="m")
        (_, front), (_, back) = self.corners
        if min(front, back) < MIN_ANGLE:
            raise ValueError(
                f"lean must leave the block standing: between {_angle(self.lean - back)} and "
                f"{_angle(self.lean + front)}, got {_angle(self.lean)}"
            )
        # (shaking would turn it the wrong way about a corner that is above its mass, and no state of rest is left)
        if max(front, back) > 0.5 * math.pi - MIN_ANGLE:
            raise ValueError(
                "lean must leave the mass centre above both corners of the base: between "
                f"{_angle(self.lean + front - 0.5 * math.pi)} and {_angle(self.lean - back + 0.5 * math.pi)}, "
                f"got {_angle(self.lean)}"
            )

    def _check_surroundings(self) -> None:
        """Raise for a wall, a bed, a restraint or an edge that the block cannot have."""
        if self.wall is not None and self.wall.height is not None and self.wall.height > self.height:
            raise ValueError(
                f"the wall's height must be at most the block's {self.height:g} m, got {self.wall.height:g}"
            )
        if self.bed is not None:
            if not self.symmetric:
                raise ValueError("a block on a bed must be symmetric: without cm_offset and lean")
            if self.restraint is not None:
                raise ValueError("a block on a bed has no restraint: what would press it onto the bed is not modelled")
            check_bed(self.bed, self.b, self.alpha)
        if self.restraint is not None:
            self._check_restraint(self.restraint)
        if self.edge is not None and self.surrounded:
            surroundings = [words for words in self.scene_words if words != self.edge.label]
            raise ValueError(
                "a block near an edge must stand free, with its mass in the middle and upright, got "
                f"{', '.join(surroundings)}: how others slide is not known"
            )

    def _check_restraint(self, restraint: Restraint) -> None:
        """Raise for a restraint that the block cannot have."""
        if self.mass is None:
            raise ValueError("a block with a restraint needs its mass (kg)")
        if restraint.front is None and restraint.back is None:
            raise ValueError(f"the {restraint.kind} acts on neither side: give a front or a back arm")
        # (a sloping cable may have an arm up to the diagonal, and one that slopes upwards less than its height)
        highest = {"cable": math.hypot(self.width, self.height), "strap": self.height, "bracket": self.height}
        limit, arm = highest.get(restraint.kind), max(restraint.front or 0.0, restraint.back or 0.0)
        size, most = ("height", self.height) if limit else ("width", self.width)
        if restraint.height is not None:
            limit, arm = most, restraint.height
        if arm > (limit or most) * (1.0 + 1e-9):
            raise ValueError(f"the {restraint.kind} must act within the block's {size} of {most:g} m, got {arm:g}")

    @classmethod
    def from_slenderness(
        cls, alpha: float, R: float, inertia_factor: float = UNIFORM_INERTIA_FACTOR, name: str | None = None
    ) -> Block:
        """Return the block of slenderness alpha (rad, 0 < alpha < pi/2) and size R (m, > 0), mass at mid-height."""
        angle = SLENDERNESS.number("alpha", alpha)
        size = HALF_DIAGONAL.number("R", R)
        return cls(2.0 * size * math.sin(angle), 2.0 * size * math.cos(angle), None, inertia_factor, name)

    @classmethod
    def from_tilt_test(
        cls, angle: float, width: float, height: float, inertia_factor: float | None = None, name: str | None = None
    ) -> Block:
        """Return the block that starts to fall at the measured tilt `angle` (rad), which *is* its alpha.

        The centre of mass lies at width/(2 tan angle) above the floor; this height must be below `height` (m).
        `inertia_factor` must be given unless the centre of mass is at mid-height.

        Never tilt a loaded piece of furniture or a rack: it and its contents can injure people. Measure an unloaded
        sample, or take the centre of mass of a loaded piece from a plan and a list of its contents (`cm_height`).

        Examples
        --------
        >>> round(Block.from_tilt_test(0.25, width=0.4, height=1.8, inertia_factor=1.3).cm_height, 3)
        0.783
        """
        tilt = checks.number("angle", angle, above=0.0, below=0.5 * math.pi, unit="rad")
        full = checks.number("width", width, above=0.0, unit="m")
        top = checks.number("height", height, above=0.0, unit="m")
        cm_height = 0.5 * full / math.tan(tilt)
        if cm_height >= top:
            raise ValueError(
                f"angle must exceed {math.atan2(0.5 * full, top):.4g} rad for width {full:g} m and height {top:g} m "
                f"(else the centre of mass is above the block), got {tilt:g}"
            )
        return cls(full, top, cm_height, inertia_factor, name)

    @property
    def b(self) -> float:
        """Half width, m."""
        return 0.5 * self.width

    @property
    def h(self) -> float:
        """Height of the centre of mass, m (half the height of a uniform block)."""
        assert self.cm_height is not None  # set in __post_init__
        return self.cm_height

    @property
    def R(self) -> float:
        """Distance from the centre of mass to the corner, m."""
        return math.hypot(self.b, self.h)

    @property
    def alpha(self) -> float:
        """Slenderness angle atan(b/h), rad."""
        return math.atan2(self.b, self.h)

    @property
    def inertia(self) -> float:
        """Inertia factor lambda = I_O/(m R²): moment of inertia about the corner over m R²."""
        assert self.inertia_factor is not None  # set in __post_init__
        return self.inertia_factor

    @property
    def gyration(self) -> float:
        """Radius of gyration about the centre of mass, m: sqrt(lambda - 1) R."""
        return math.sqrt(self.inertia - 1.0) * self.R

    @property
    def symmetric(self) -> bool:
        """True if front and back are alike: no offset of the mass, no lean."""
        return self.cm_offset == 0.0 and self.lean == 0.0

    @property
    def surrounded(self) -> bool:
        """True if the block is not symmetric and freestanding on a rigid floor (an edge aside)."""
        return not self.symmetric or any(part is not None for part in (self.wall, self.restraint, self.bed))

    @property
    def sided(self) -> bool:
        """True if the block responds differently to a motion and its reverse: its front and back differ."""
        wall, restraint = self.wall, self.restraint
        niche = wall is None or wall.front_gap == wall.gap
        return not (self.symmetric and niche and (restraint is None or restraint.front == restraint.back))

    @property
    def corners(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Of front and back: the mass centre's horizontal distance to the corner (m), and the angle (rad) to tip it."""
        front, back = self.b - self.cm_offset, self.b + self.cm_offset
        return (front, math.atan2(front, self.h) - self.lean), (back, math.atan2(back, self.h) + self.lean)

    @property
    def balances(self) -> tuple[float, float]:
        """Rotations to front and back beyond which it falls by itself, rad: the angles of `corners`, less on a bed."""
        (_, front), (_, back) = self.corners
        if self.bed is None:
            return front, back
        balance = self.alpha * balance_on_bed(self.bed.settlement / (self.b * self.alpha))
        return balance, balance

    @property
    def across(self) -> Block:
        """The block as it rocks in the direction of its depth; its front and back are then the ends of its depth.

        A wall, a restraint, an offset of the mass and a lean act in the direction of the width: along its depth the
        block is free. The friction of a wall or a restraint in that direction is left out, on the safe side.

        Raises
        ------
        ValueError
            A block without a depth; one on a soft bed; an inertia factor that no body of these sizes has.

        Notes
        -----
        The inertia factor of a uniform block is 4/3 in every direction. Otherwise the mass is assumed to be distributed
        in plan as in a uniform block and in height by the given factor: rho'² = rho² + (depth² - width²)/12.
        """
        if self.depth is None:
            raise ValueError(f"{self.label!r} needs its depth (m), its size in the other horizontal direction")
        if self.bed is not None:
            raise ValueError(f"{self.label!r} must not lie on a soft bed where it rocks in both directions")
        factor = self.inertia
        middle = math.isclose(self.h, 0.5 * self.height, rel_tol=1e-9)
        if self.depth != self.width and not (middle and factor == UNIFORM_INERTIA_FACTOR):
            square = self.gyration**2 + (self.depth**2 - self.width**2) / 12.0
            factor = 1.0 + square / (0.25 * self.depth**2 + self.h**2)
        try:
            free: dict[str, Any] = {"wall": None, "restraint": None, "edge": None, "cm_offset": 0.0, "lean": 0.0}
            return replace(self, width=self.depth, inertia_factor=factor, name=self.label, **free)
        except ValueError as error:
            raise ValueError(f"{self.label!r} in the direction of its depth: {error}") from None

    @property
    def p(self) -> float:
        """Rocking frequency parameter sqrt(g/(lambda R)), rad/s."""
        return math.sqrt(STANDARD_GRAVITY / (self.inertia * self.R))

    @property
    def restitution(self) -> float:
        """Housner's coefficient of restitution e_R = 1 - (2/lambda) sin² alpha; ValueError if it is not positive.

        With the mass off the middle, front to back and back to front have different factors. The root of their product
        is e_R = (rho² + h² - b b')/sqrt(i i'), which takes e_R² of the energy either way (derived).
        """
        e = 1.0 - 2.0 / self.inertia * math.sin(self.alpha) ** 2
        if self.cm_offset != 0.0:
            square = self.gyration**2 + self.h**2
            front, back = self.b - self.cm_offset, self.b + self.cm_offset
            e = (square - front * back) / math.sqrt((square + front**2) * (square + back**2))
        if e <= 0.0:
            likely = likely_sizes(self.width, self.height)
            meant = f"{likely}? If not, " if likely else ""
            raise ValueError(
                f"Housner's restitution of a block with alpha = {self.alpha:.4g} rad is {e:.4g}, not positive: "
                f"{meant}so squat a block needs an explicit e with 0 < e <= 1"
            )
        return e

    @property
    def label(self) -> str:
        """The name, or the sizes if the block has no name (and the height of its mass if it is not the middle)."""
        if self.name is not None:
            return self.name
        assert self.cm_height is not None  # (set above)
        words = [f"{self.width:.4g} m × {self.height:.4g} m"]
        if not math.isclose(self.cm_height, 0.5 * self.height, rel_tol=1e-9):
            words.append(f"mass at {self.cm_height:.4g} m")
        if self.round:
            words.append("round")
        elif self.depth is not None:
            words.append(f"{self.depth:.4g} m deep")
        return ", ".join([*words, *self.scene_words])

    @property
    def scene_words(self) -> list[str]:
        """Special features of its position and surroundings, in a few words each; empty without any."""
        words = []
        if self.cm_offset != 0.0:
            side = "front" if self.cm_offset > 0.0 else "back"
            words.append(f"mass {1000.0 * abs(self.cm_offset):.4g} mm to the {side}")
        if self.lean != 0.0:
            side = "front" if self.lean > 0.0 else "back"
            words.append(f"leans {math.degrees(abs(self.lean)):.3g}° to the {side}")
        if self.tilt_limit is not None:
            words.append(f"fails at a tilt of {math.degrees(self.tilt_limit):.3g}°")
        return words + [part.label for part in (self.wall, self.restraint, self.bed, self.edge) if part is not None]


def describe_block(block: Block) -> dict[str, Any]:
    """Return the parameters that define the block, as plain values (SI)."""
    return {
        "name": block.label,
        "width": block.width,
        "height": block.height,
        "cm_height": block.cm_height,
        "inertia_factor": block.inertia_factor,
        **({} if block.depth is None else {"depth": block.depth}),
        **({"round": True} if block.depth is not None and block.round else {}),
        **describe_scene(block),
        **({} if block.edge is None else {"edge": asdict(block.edge)}),
    }


def describe_scene(block: Block) -> dict[str, Any]:
    """Return what makes a block other than symmetric, freestanding and without a tilt limit, as plain values (SI).

    The mass is among them if a restraint needs it.
    """
    scene: dict[str, Any] = {}
    if not block.symmetric:
        scene |= {"cm_offset": block.cm_offset, "lean": block.lean}
    if block.wall is not None:
        scene["wall"] = asdict(block.wall)
    if block.restraint is not None:
        # (where it is fixed changes nothing)
        held = {name: value for name, value in asdict(block.restraint).items() if name != "height"}
        scene |= {"mass": block.mass, "restraint": held}
    if block.bed is not None:
        scene["bed"] = asdict(block.bed)
    if block.tilt_limit is not None:
        scene["tilt_limit"] = block.tilt_limit
    return scene


def block_from(described: Mapping[str, Any]) -> Block:
    """Return the block that `describe_block` describes."""
    values = dict(described)
    for name, part in PARTS.items():
        if values.get(name) is not None:
            values[name] = part(**values[name])
    return Block(**values)


def likely_sizes(width: float, height: float) -> str:
    """Return the plausible sizes that a slip may have turned into these, in words; '' for none.

    >>> likely_sizes(1.95, 0.45)
    '0.45 m × 1.95 m with width and height exchanged'
    """
    if _plausible(width, height):
        return ""
    slips = [(height, width, "with width and height exchanged")]
    slips += [(width / factor, height / factor, f"with both divided by {factor:g}") for factor in FACTORS]
    slips += [(width / factor, height, f"with the width divided by {factor:g}") for factor in FACTORS]
    slips += [(width, height / factor, f"with the height divided by {factor:g}") for factor in FACTORS]
    slips += [(height / factor, width / factor, f"with both exchanged and divided by {factor:g}") for factor in FACTORS]
    units = [(width * unit, height * unit, f"as {name}") for name, unit in UNITS_OF_LENGTH.items()]
    units = [slip for slip in units if slip[1] >= LEAST_FURNITURE]
    likely = (next((slip for slip in kind if _plausible(*slip[:2])), None) for kind in (slips, units))
    return ", or ".join(f"{slip[0]:.4g} m × {slip[1]:.4g} m {slip[2]}" for slip in likely if slip)


def _plausible(width: float, height: float) -> bool:
    bounded = ((width, WIDTHS), (height, HEIGHTS), (height / width, RATIOS))
    return all(low <= value <= high for value, (low, high) in bounded)


def _angle(value: float) -> str:
    """Return an angle in radians with its degrees."""
    return f"{value:.4g} rad ({math.degrees(value):.3g}°)"
