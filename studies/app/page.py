"""The live page: its state, its computations one after the other, and its parts as HTML."""

from __future__ import annotations

import copy
import hashlib
import math
import re
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import ChoiceLoader, Environment, FileSystemLoader
from markupsafe import Markup

from ...core.doubts import noted
from ...core.parameters import USUAL_MEASURE, USUAL_YEARS, declared
from ...core.wording import counted, given_number, two_digits
from ...core.writing import write_bytes
from ...fragility.hazard.poisson import probability_in
from ...fragility.runs.scaling import ground_of, scaling
from ...models import Block, catalogue
from ...models.friction import CONTACTS
from ...models.laws import LAWS
from ...motions import records
from ..comparison.ratios import REGISTER
from ..facts.say import environment, say
from ..file.hazard import COMMON
from ..film import fittings
from ..film.frames import corners, frames_of
from ..kinds.fragility import FragilityStudy
from ..single.run import Simulation
from ..tables.registry import tables
from ..tables.table import Table
from ..text.error import StudyError, writing
from ..text.words import LAW_NAMES, MEASURES, value_in, with_law_names
from . import piece_studies, state
from .piece_studies import Full, Numbers, RefusalError, SupersededError
from .state import LESS_RESTITUTION, PIECE, REMEDIES, VARIANT

TEMPLATES = Path(__file__).parent / "templates"
PERSON = 1.75
"""Height of the person beside the piece, m."""
TARGET = 0.01
"""Chance that a restraint is to keep, as the page begins."""
RANGES, REST = STAGES = ("ranges", "rest")
"""Stages of the full answer: the ranges of the chances, and then restraints and the variant."""
HAZARD_ENDINGS = (".csv", ".json")
FILM_SPEED, FILM_FRAMES = 1.0, 25
WIDTH, HEIGHT, LEFT, TOP, BOTTOM = 640.0, 332.0, 76.0, 16.0, 52.0
"""Size and margins of the curve's drawing."""
SLIDERS = {
    "blocks.0.width_m": (0.1, 1.5),
    "blocks.0.height_m": (0.3, 3.0),
    "blocks.0.wall_gap_mm": (0.0, 300.0),
    "motions.magnitude": (6.0, 7.7),
    "motions.distance_m": (1e4, 1e5),
    "strength_n": (50.0, 3000.0),
}
"""Ends of sliders, in units of the study file; the last is of restraints."""


@dataclass
class Page:
    """The state of the page and of its answers; one change at a time."""

    path: Path
    content: dict[str, Any]
    length: str = "cm"
    target: float = TARGET
    version: int = 0
    quick: Numbers | None = None
    numbers: dict[str, Numbers] = field(default_factory=dict)
    """Numbers of the studies of the chances."""
    numbers_of: int = -1
    """The version that the numbers are of."""
    full: Full | None = None
    full_of: int = -1
    """The version that the full answer is of."""
    studies: dict[str, FragilityStudy] = field(default_factory=dict)
    contents: dict[str, dict[str, Any]] = field(default_factory=dict)
    lock: threading.RLock = field(default_factory=threading.RLock)

    @classmethod
    def opened(cls, path: Path, *, given: bool) -> Page:
        """Return the page of a study file, or of the state kept in its folder; StudyError if it can show neither."""
        live = state.live_file(path)
        if given and not path.is_file():
            raise StudyError(f"{path}: no such file")
        source = live if live.is_file() else path
        content = state.read_state(source) if source.is_file() else state.start_state()
        page = cls(live, content)
        page.contents = piece_studies.contents_of(content)
        if (file := state.file_of(live, VARIANT)).is_file():
            page.contents[VARIANT] = state.with_held(state.read_state(file))
        return page

    def change(self, path: str, text: str) -> dict[str, str]:
        """Change one key, and return the parts of the page that change at once; StudyError if it is wrong."""
        with self.lock:
            if path == "length":
                if text not in state.LENGTHS:
                    raise StudyError(f"length: must be one of {', '.join(state.LENGTHS)}, got {text[:20]!r}")
                self.length = text
                return {"form": self.form()}
            if path == "target":
                self._aim(text)
                return {"remedies": self.remedies()} if self.full_of == self.version else {}
            slid = path in SLIDERS or path in state.OF_LAWS or path.startswith("restraints.")
            slid &= not text.strip()[-1:].isalpha()  # (a text with its unit is shown again in the unit of the page)
            try:
                return self._take(state.edited(self.content, path, text, self.length), slid)
            except StudyError as error:
                raise RefusalError(str(error), getattr(error, "path", "") or path[:100]) from None

    def take_hazard(self, name: str, content: bytes) -> dict[str, str]:
        """Take the hazard curve of a file, which is kept with the studies; StudyError if a study cannot use it."""
        shown = " ".join(name.split())[:60]
        if not (ending := Path(shown.lower()).suffix) or ending not in HAZARD_ENDINGS:
            raise StudyError(f"hazard: must be a file with {' or '.join(HAZARD_ENDINGS)}, got {shown!r}")
        # (saved studies keep the content that they were saved with)
        stem = "-".join(re.findall("[A-Za-z0-9]+", Path(shown).stem))[:20]
        file = self.path.parent / f"hazard-{stem}-{hashlib.sha256(content).hexdigest()[:16]}{ending}"
        with self.lock:
            new = not file.exists()
            if new:
                with writing(file):
                    write_bytes(file, content)
            kept = {key: value for key, value in self.content.get("hazard", {}).items() if key in COMMON}
            try:
                return self._take({**self.content, "hazard": {**kept, "file": file.name}}, False)
            except StudyError as error:
                if new:
                    file.unlink()
                raise StudyError(str(error).replace(str(file), shown).replace(file.name, shown)) from None

    def _take(self, content: dict[str, Any], slid: bool) -> dict[str, str]:
        with self.lock:
            contents = piece_studies.contents_of(content)
            if VARIANT in self.contents:
                contents[VARIANT] = self.contents[VARIANT]
            studies = {PIECE: piece_studies.study_of(contents[PIECE], self.path)}
            quick = piece_studies.numbers_of(piece_studies.reference_of(studies[PIECE]), quick=True)
            # (the files of the other studies follow with the full answer)
            state.write_state(self.path, {PIECE: contents[PIECE]})
            self.content, self.contents, self.studies, self.quick = content, contents, studies, quick
            self.version += 1
            return self.parts(form=not slid)

    def _aim(self, text: str) -> None:
        target = state.number_in(text.replace("%", ""), "chance") / 100.0
        if not 0.0 < target < 1.0:
            raise StudyError(f"chance: must be between 0 and 100 %, got {text[:20]!r}")
        self.target = target

    def begin(self) -> None:
        """Compute the first answer before the page asks for it, which then shows what is wrong."""
        with suppress(StudyError):
            self.parts()

    def parts(self, *, form: bool = True) -> dict[str, str]:
        """Return the parts of the page that show its quick answer."""
        with self.lock:
            if self.quick is None:
                self.quick = piece_studies.numbers_of(piece_studies.reference_of(self.piece), quick=True)
            made = {"scene": self.scene(), **self.chances()}
            return {"form": self.form(), **made} if form else made

    def complete(self, version: int, stage: str = REST) -> dict[str, str] | None:
        """Compute the full answer of a version up to a stage, and return its parts; None if a later change came."""
        if stage not in STAGES:
            raise StudyError(f"stage: must be one of {', '.join(STAGES)}, got {stage[:20]!r}")

        def stopped() -> bool:
            return self.version != version

        with self.lock:
            if stopped():
                return None
            contents, studies, before = {**self.contents}, {**self.studies, PIECE: self.piece}, self.full
            numbers = dict(self.numbers) if self.numbers_of == version else {}
        less = {*LESS_RESTITUTION.values()}
        try:
            for name, content in contents.items():
                if name not in studies and (stage == REST or name in {*LESS_RESTITUTION} | less):
                    studies[name] = piece_studies.study_of(content, self.path)
            for name in [*LESS_RESTITUTION, *less & {*contents}] if not numbers else []:
                numbers[name] = piece_studies.numbers_of(studies[name], stopped, quick=name in less)
            if stage == REST:
                others = {name: studies[name] for name in contents if name not in less}
                full = piece_studies.full_of(others, self.path, before, stopped)
        except SupersededError:
            return None
        with self.lock:
            if stopped():
                return None
            self.studies, self.numbers, self.numbers_of = studies, numbers, version
            if stage == RANGES:
                return self.chances()
            state.write_state(self.path, contents)
            self.full, self.full_of = full, version
            made = {"basis": self.render("basis"), "variants": self.render("variants")}
            return {**self.chances(), **made, "remedies": self.remedies()}

    def chances(self) -> dict[str, str]:
        """Return the parts of the page that show the chances."""
        return {**{name: self.render(name) for name in ("answer", "brief")}, "curve": self.curve()}

    def keep(self, what: str) -> dict[str, str]:
        """Keep the piece as the variant for later comparisons, or forget the variant."""
        with self.lock:
            file = state.file_of(self.path, VARIANT)
            if what == "keep":
                self.contents[VARIANT] = copy.deepcopy(self.contents[PIECE])
                state.write_state(self.path, {VARIANT: self.contents[VARIANT]})
                self.studies[VARIANT] = self.piece
            elif what == "forget":
                self.contents.pop(VARIANT, None)
                self.studies.pop(VARIANT, None)
                file.unlink(missing_ok=True)
            else:
                raise StudyError(f"variant: must be keep or forget, got {what[:20]!r}")
            if self.full is not None:
                self.full = self.full._replace(compared=None)
            self.version += 1
            return {"variants": self.render("variants")}

    def save(self, name: str) -> list[Path]:
        """Write the studies under a name into the folder of the page; StudyError for a name that is none."""
        stem = name.strip().removesuffix(".toml")
        plain = stem.replace(" ", "").replace("-", "").replace("_", "")
        if not (plain.isalnum() and plain.isascii() and len(stem) <= 60):
            raise StudyError(f"name: must have letters, digits, spaces, - and _ only, got {name[:40]!r}")
        with self.lock:
            path = self.path.parent / f"{stem}.toml"
            taken = next((file for kind in self.contents if (file := state.file_of(path, kind)).exists()), None)
            if taken is not None:
                raise StudyError(f"{taken.name}: there is a file of that name already; choose another name")
            return state.write_state(path, self.contents)

    def text(self, name: str) -> str:
        """Return the text of one of the page's study files."""
        if name not in self.contents:
            raise StudyError(f"the page has no study {name[:40]!r}")
        return state.toml_of(self.contents[name])

    def python(self, name: str) -> str:
        """Return a script that reproduces the results of one of the studies."""
        file, text = state.file_of(Path("piece.toml"), name).name, self.text(name)
        literal = repr(text) if "'''" in text else f"r'''\n{text}'''"  # (in lines if it can be)
        return self.render("python", text=literal, file=file, study=name)

    # --- parts

    def render(self, name: str, **more: Any) -> str:
        """Return a part of the page, or a page, from its template."""
        ending = "py" if name == "python" else "html"
        current, checked = self.numbers_of == self.version, self.full_of == self.version
        whole = {"page": self, "state": state, "current": current, "checked": checked, **more}
        if name == "python":
            made = environment(escaping=False)
            made.loader = FileSystemLoader(TEMPLATES)
            return made.get_template(f"{name}.{ending}.j2").render(whole)
        with noted():  # (what is doubted of a rate is among the checks)
            return Markup(page_templates().get_template(f"{name}.{ending}.j2").render(whole))

    def form(self) -> str:
        """Return the form."""
        return self.render("form", items=[*catalogue], contacts=CONTACTS, laws=self.laws)

    @property
    def laws(self) -> list[tuple[str, str, bool]]:
        """The laws that need no option: short name, name, and whether the study has it."""
        free = [law for law in LAWS if not any(about.needed for about in declared(LAWS[law]).values())]
        chosen = {model.get("law") for model in self.content["models"]}
        return [(law, LAW_NAMES.get(law, law), law in chosen) for law in free]

    def of_laws(self, key: str) -> tuple[str, Any, str]:
        """An option of all laws: its path, its value and its sentence; the value '' if laws have their own."""
        places = state.laws_with(self.content, key)
        given = {self.content["models"][i].get(key) for i in places}
        about = state.declared_at(self.content, f"models.{places[0]}.{key}") if places else {}
        value = given.pop() if len(given) == 1 else None
        return f"models.{key}", "" if value is None else value, str(about.get("description", ""))

    def value(self, path: str) -> Any:
        """Return the value of a key of the state."""
        return state.value_at(self.content, path)

    def field(self, path: str) -> state.Field:
        """Return a key with its declaration."""
        return state.field(self.content, path, self.length)

    def ends(self, path: str) -> tuple[float, float] | None:
        """Return the ends of the slider of a key in the unit shown; None if it has none."""
        key = path.rpartition(".")[2] if path.startswith("restraints.") else path
        if key not in SLIDERS:
            return None
        factor, _ = state.factor_of(path, str(state.declared_at(self.content, path).get("unit", "")), self.length)
        return SLIDERS[key][0] / factor, SLIDERS[key][1] / factor

    @property
    def piece(self) -> FragilityStudy:
        """The study of the piece, made at its first use; StudyError if it is wrong."""
        with self.lock:
            if PIECE not in self.studies:
                self.studies[PIECE] = piece_studies.study_of(self.contents[PIECE], self.path)
            return self.studies[PIECE]

    @property
    def block(self) -> Block:
        """The piece, with its restraint."""
        block: Block = self.piece.blocks[0]
        return block

    @property
    def floors(self) -> int:
        """Number of the highest floor if the page lets one choose, else 0."""
        about = self.value("building") or {}
        one_floor = isinstance(about.get("floors"), list) and len(about["floors"]) == 1
        return int(about["storeys"]) if one_floor and isinstance(about.get("storeys"), int) else 0

    @property
    def measure(self) -> str:
        """The measure of the levels."""
        name = str(self.value("ida.im") or USUAL_MEASURE)
        return MEASURES.get(name, name)

    def scene(self) -> str:
        """Return the drawing of the piece next to a person, in metres."""
        block = self.block
        gap = None if block.wall is None else block.wall.gap
        level = None if block.restraint is None else block.restraint.front or block.restraint.back or block.height
        size = " × ".join(f"{value / state.LENGTHS[self.length]:.4g}" for value in (block.width, block.height))
        top = max(PERSON, block.height) * 1.1
        behind = 0.12 if gap is None and level is not None else gap
        left = -(0.08 + (behind or 0.0))
        right = block.width + 0.95
        more = {"gap": gap, "behind": behind, "level": level, "size": f"{size} {self.length}", "top": top}
        return self.render("scene", block=block, left=left, right=right, person=PERSON, **more)

    def curve(self) -> str:
        """Return the drawing of the curve with the runs behind it."""
        numbers = self.numbers[PIECE] if self.numbers_of == self.version else self.quick
        assert numbers is not None
        curve = numbers.curve
        low, high = math.log(curve.at[0]), math.log(curve.at[-1])

        def x(level: float) -> float:
            return round(LEFT + (WIDTH - LEFT - 12.0) * (math.log(level) - low) / (high - low), 1)

        def y(share: float) -> float:
            return round(TOP + (HEIGHT - BOTTOM - TOP) * (1.0 - share), 1)

        band = [(x(level), y(share)) for level, share in zip(curve.at, curve.upper, strict=True)]
        band += [(x(level), y(share)) for level, share in zip(curve.at[::-1], curve.lower[::-1], strict=True)]
        runs = zip(curve.at, curve.seen, curve.lower, curve.upper, strict=True)
        steps = [10.0**power * k for power in range(-4, 5) for k in (1, 2, 5)]
        return self.render(
            "curve",
            curve=curve,
            line=" ".join(f"{x(at)},{y(p)}" for at, p in zip(curve.levels, curve.shares, strict=True)),
            band=" ".join(f"{at},{p}" for at, p in band),
            points=[(x(at), y(seen), y(lower), y(upper)) for at, seen, lower, upper in runs],
            ticks=[(x(step), step) for step in steps if curve.at[0] <= step <= curve.at[-1]],
            shares=[(y(share), share) for share in (0.0, 0.25, 0.5, 0.75, 1.0)],
            levels=[*zip(curve.at, curve.seen, curve.lower, curve.upper, strict=True)],
            size=(WIDTH, HEIGHT, LEFT, HEIGHT - BOTTOM),
        )

    @property
    def ranges(self) -> list[tuple[str, Any]]:
        """The chances with their ranges: in the earthquake, per year, in the years of the hazard."""
        pairs = []
        for study, less in LESS_RESTITUTION.items():
            changed = self.numbers[less].chances if less in self.numbers else None
            pairs.append((with_law_names(self.numbers[study].chances), changed))
        chances = [("earthquake", piece_studies.range_at(*pairs[1], "probability", ("lower", "upper")))]
        if "rate" in pairs[0][0]:
            rate = piece_studies.range_at(*pairs[0], "rate", ("rate_lower", "rate_upper"))
            ends = "risk_probability_lower", "risk_probability_upper"
            chance = piece_studies.range_at(*pairs[0], "risk_probability", ends)
            chances += [("year", rate.over(1.0)), ("years", chance._replace(friction=rate.over(self.years).friction))]
        return chances

    @property
    def about(self) -> list[tuple[float, float]]:
        """The chances under the reference law, without ranges, each with its years; none without a hazard."""
        chances = None if self.quick is None else self.quick.chances
        if chances is None or "rate" not in chances:
            return []
        values = [float(chances[name].squeeze()) for name in ("rate", "risk_probability")]
        return [(float(probability_in(np.float64(values[0]), 1.0)), 1.0), (values[1], self.years)]

    less = piece_studies.LEAST_FACTOR

    @property
    def comparison(self) -> list[str]:
        """The sentences of the comparison with the variant."""
        compared = None if self.full is None else self.full.compared
        return [] if compared is None else [say(fact, REGISTER) for fact in (*compared.answer, *compared.notes)]

    def tables(self, name: str) -> list[Table]:
        """Return the tables of a name in the report of the piece, such as curves or slides."""
        return [] if self.full is None else [*tables(with_law_names(self.full.results[PIECE]), (name,))]

    @property
    def years(self) -> float:
        """The years of the hazard."""
        return float(self.content.get("hazard", {}).get("years", USUAL_YEARS))

    def remedies(self) -> str:
        """Return the table of restraints."""
        assert self.full is not None
        results = self.full.results.get(REMEDIES)
        remedies = [] if results is None else piece_studies.remedies_in(results, self.content.get("restraints", {}))
        law = "" if results is None else str(with_law_names(results)["model"].values[0])
        return self.render("remedies", remedies=remedies, best=piece_studies.cheapest(remedies, self.target), law=law)

    def film(self, level: int, motion: int) -> dict[str, Any]:
        """Return the frames of one run of the piece: the corners of the block and the floor, m, frame by frame."""
        with self.lock:
            study = piece_studies.reference_of(self.piece)
        array = study.design.motions[0]
        if not (0 <= level < study.design.levels.size and 0 <= motion < array.sizes["motion"]):
            raise StudyError(f"motion: must be from 1 to {array.sizes['motion']}, at one of the levels")
        design = study.design
        plain = records(design.motions)
        below = ground_of(plain, records(design.ground)) if design.ground else None
        scaled = scaling(design.levels, plain, design.im, study.blocks, below)
        factor = float(np.asarray(scaled.factors)[0, level, motion])
        at = value_in(float(design.levels[level]), scaled.units)
        chosen = array.isel({"motion": [motion], **{dim: 0 for dim in ("floor",) if dim in array.dims}})
        run = Simulation(study.blocks[0], study.models[0], chosen, factor)
        response = run.shown
        frames = frames_of(response, speed=FILM_SPEED, fps=FILM_FRAMES)
        block = study.blocks[0]
        floor = frames.displacement - frames.displacement[0]
        boxes = [
            np.round(corners(block, float(turn), float(moved)), 3).ravel().tolist()
            for turn, moved in zip(frames.rotation, floor, strict=True)
        ]
        reach = max(block.width, block.height)
        faces = fittings.faces(response, block)
        breaks = float(run.response["rupture_time"]) if block.restraint is not None else math.inf
        ties = [
            np.round(fittings.line(block, strap, float(turn))[[0, -1]] + [[moved, 0.0]], 3).ravel().tolist()
            for strap in fittings.straps(block, faces)[:1]
            for turn, moved, time in zip(frames.rotation, floor, frames.time, strict=True)
            if not time >= breaks
        ]
        return {
            "boxes": boxes,
            "floor": np.round(floor, 3).tolist(),
            "walls": [face.x for face in faces],
            "ties": ties,
            "fps": frames.fps,
            "view": [float(floor.min()) - reach - 0.1, float(floor.max()) + reach + 0.1, block.height * 1.25],
            "outcome": self.render("film", run=run.response, motion=motion + 1, at=at),
        }


@cache
def page_templates() -> Environment:
    """Return the templates of the page, with the filters of reports."""
    made = environment(escaping=True)
    assert made.loader is not None
    made.loader = ChoiceLoader([FileSystemLoader(TEMPLATES), made.loader])
    made.filters |= {"digits": two_digits, "as_given": given_number, "counted": counted}
    return made
