"""A building full on the live page: its table and study as files, runs in the background, and ticks before and after.

The page has two studies of one table: as it is, and with the ticked pieces anchored or moved. Both are files for
`toppling run`, and `Study.run` gives their results. Runs are remembered, so that a tick needs none.
"""

from __future__ import annotations

import copy
import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from markupsafe import Markup

from ...core.doubts import noted
from ...core.limits import whole_content
from ...core.wording import confidence_text
from ...core.writing import write_bytes
from ...fragility.runs.runners import Remembered
from ..buildings.pieces import pieces_of
from ..buildings.recommendations import Piece
from ..comparison.pieces import compare_pieces
from ..comparison.ratios import table_of
from ..comparison.sides import Side
from ..facts.method import study_of
from ..facts.say import say
from ..facts.sections import REGISTERS, sections
from ..file.include import read_content
from ..file.schema import StudyFile, read_study_file
from ..inventory.reading import COLUMNS, KIND
from ..inventory.sheet import Sheet
from ..kinds.study import Study
from ..report.page import write_report
from ..store.folder import RESULT_NAME
from ..store.progress import Display
from ..tables.pieces import pieces
from ..tables.table import Table
from ..text.error import StudyError, writing
from ..text.words import reference_law, with_law_names
from . import state
from .page import page_templates
from .piece_studies import SupersededError

BEFORE, AFTER = "before", "after"
"""The studies: the table as it is, and with the ticked changes."""
FIELDS = {
    "building.storeys": "Storeys",
    "building.period_s": "First period of the building",
    "motions.magnitude": "Magnitude of the earthquake",
    "motions.distance_m": "Distance to the fault",
    "motions.vs30_m_s": "Stiffness of the soil, Vs30",
}
"""Keys of the study that the page edits, in addition to the levels of the hazard."""
SPENT = ("budget", "target", "kits")
"""Keys on what could be anchored, which the study after it does not have."""
TICKED, MOST_LINES = ("anchored", "floor"), 100
"""Columns that ticks change, and most lines of a table that are shown at a time."""
RANKED = ("item", "room", "floor", "pieces", "chance", "model_range", "recommendation", "anchoring_cost")


@dataclass
class Building:
    """The state of the page, the thread that runs its studies, and their results.

    `ticks`: by line, the changed cells of `TICKED`. `first`: the first line shown. `version`: number of times that the
    runs ended. `wrong`: the sentence of an error. `shown`: the part of the page with the results. `pieces`: the pieces
    as they are, in the order of the table. `_of`: the files of the results.
    """

    path: Path
    content: dict[str, Any]
    sheet: Sheet | None = None
    ticks: dict[int, dict[str, str]] = field(default_factory=dict)
    first: int = 0
    results: dict[str, xr.Dataset] = field(default_factory=dict)
    version: int = 0
    wrong: str = ""
    shown: str = ""
    pieces: list[Piece] = field(default_factory=list)
    progress: tuple[str, int, int, str] | None = None
    stopped: bool = False
    lock: threading.RLock = field(default_factory=threading.RLock)
    memory: Remembered = field(default_factory=Remembered)
    _of: dict[str, tuple[bytes, bytes]] = field(default_factory=dict)
    _thread: threading.Thread | None = None
    _wanted: int = 0

    @classmethod
    def opened(cls, path: Path, *, given: bool) -> Building:
        """Return the page of a study of an inventory, or of its state in the same folder; no motions are made yet."""
        live = state.live_file(path)
        source = live if live.is_file() else path
        if given and not path.is_file():
            raise StudyError(f"{path}: no such file")
        content: dict[str, Any] = read_content(source, StudyFile).content if source.is_file() else start_content()
        asked = content.get("performance")
        if not isinstance(asked, dict) or not isinstance(asked.get("inventory"), str):
            raise StudyError(f"{source}: performance.inventory: must name the table of the pieces")
        if given and source != live:
            read_study_file(source)
        page, table = cls(live, content), source.parent / asked["inventory"]
        page.sheet = _sheet(table) if given or table.is_file() else None
        after = page.file(AFTER, ".csv")
        if source == live and page.sheet is not None and after.is_file():
            page.ticks = page.sheet.differences(_sheet(after), TICKED)
        content["performance"] = {"sort": "chance", **asked, "inventory": page.file(BEFORE, ".csv").name}
        return page

    def file(self, name: str, suffix: str = ".toml") -> Path:
        """Return the file of a study, of its table, or the folder of its results."""
        return state.file_of(self.path, state.PIECE if name == BEFORE else name).with_suffix(suffix)

    @property
    def files(self) -> dict[str, tuple[bytes, bytes]]:
        """The text of each study, and of its table."""
        if self.sheet is None:
            return {}
        texts = {BEFORE: (state.toml_of(self.content).encode(), self.sheet.content)}
        if self.ticks:
            content, sheet = copy.deepcopy(self.content), self.sheet
            asked = {key: value for key, value in content["performance"].items() if key not in SPENT}
            content["performance"] = {**asked, "inventory": self.file(AFTER, ".csv").name}
            content["title"] = f"{content.get('title', 'A building')}: {AFTER}"
            for line, cells in self.ticks.items():
                for column, text in cells.items():
                    sheet = sheet.with_text(line, column, text)
            held = {sheet.cell(line, "anchored") for line in range(len(sheet.lines))}
            used = {name: table for name, table in content.pop("restraints", {}).items() if name in held}
            content |= {"restraints": used} if used else {}
            texts[AFTER] = state.toml_of(content).encode(), sheet.content
        return texts

    def drop(self, name: str, content: bytes) -> dict[str, str]:
        """Take a table instead of the present table."""
        with self.lock:
            self.sheet = Sheet.read(Path(name.replace("\\", "/")).name[-100:] or "table", content)
            self.ticks, self.first = {}, 0
            return self._with_other_lines()

    def change(self, path: str, text: str) -> dict[str, str]:
        """Change a cell, a tick or a key, and begin its runs; return the table if its lines or columns change."""
        with self.lock:
            before = self.sheet
            if path == "lines" and before is not None:
                self.first = before.line(text) // MOST_LINES * MOST_LINES
                return {"sheet": self.render("sheet")}
            if path != "run":
                self._edit(path, text)
            if before is not None and self.sheet is not None and self.sheet.shape != before.shape:
                return self._with_other_lines()
            self._begin(go=(path, text) != ("run", "stop"))
            return {}

    def _with_other_lines(self) -> dict[str, str]:
        """Begin the runs of other lines; ticks in the earlier results would be of wrong lines."""
        self.shown = ""
        self._begin()
        return {"sheet": self.render("sheet"), "result": ""}

    def _edit(self, path: str, text: str) -> None:
        word, _, rest = path.partition(".")
        asked = self.content["performance"]
        if path in FIELDS and state.value_at(self.content, path) is not None:
            table, key = path.split(".")
            self.content[table][key] = state.number_of(self.content, path, text, "cm")
        elif word == "hazard" and rest in map(str, range(len(state.hazard_points(self.content)))):
            self.content["hazard"]["levels"][int(rest)] = state.positive(text, "hazard.levels")
        elif path == "budget":
            budget = state.number_in(text, path) if text.strip() else 0.0
            left = {key: value for key, value in asked.items() if key != path}
            self.content["performance"] = {**left, path: budget} if budget > 0.0 else left
        elif self.sheet is None:
            raise StudyError(f"{path[:40]!r}: drop a table first")
        elif path == "take":
            if self._of.get(BEFORE) != self.files[BEFORE]:
                raise StudyError("take: wait until the runs of the table have ended")
            moved = {i: {"floor": cells["floor"]} for i, cells in self.ticks.items() if "floor" in cells}
            held = {i: {**moved.get(i, {}), "anchored": kit} for i, kit in self.chosen.items()}
            self.ticks = {**moved, **held}
        elif word in TICKED:
            line = self.sheet.line(rest)
            cells = {**self.ticks.get(line, {}), word: "".join(filter(str.isprintable, text)).strip()}
            kept = {column: cell for column, cell in cells.items() if cell and cell != self.sheet.cell(line, column)}
            self.sheet.with_text(line, word, text)  # (a text that no cell can have is an error)
            self.ticks = {**self.ticks, line: kept} if kept else {i: c for i, c in self.ticks.items() if i != line}
        elif word in ("cell", "remove"):
            at, _, column = rest.partition("-")
            before = len(self.sheet.lines)
            self.sheet = self.sheet.edited(at, column, text if word == "cell" else None)
            if len(self.sheet.lines) < before:
                gone, self.first = int(at), min(self.first, max(before - 2, 0) // MOST_LINES * MOST_LINES)
                self.ticks = {i - (i > gone): cells for i, cells in self.ticks.items() if i != gone}
        else:
            raise StudyError(f"{path[:40]!r}: the page does not edit this key")

    # --- runs in the background

    def _begin(self, *, go: bool = True) -> None:
        """Write the state, each file completely or not at all, and begin its runs instead of earlier runs."""
        for name, texts in self.files.items():
            for file, content in zip((self.file(name), self.file(name, ".csv")), texts, strict=True):
                with writing(file):
                    write_bytes(file, content)
        for suffix in () if self.ticks else (".toml", ".csv"):
            self.file(AFTER, suffix).unlink(missing_ok=True)
        self._wanted += 1
        self.stopped = not go
        if go and self.sheet is not None:
            self.wrong, self.progress, before = "", (BEFORE, 0, 0, ""), self._thread
            self._thread = threading.Thread(target=self._work, args=(self._wanted, before), daemon=True)
            self._thread.start()

    def _work(self, wanted: int, before: threading.Thread | None) -> None:
        """Run the studies whose files have changed, once an earlier thread has ended."""
        if before is not None:
            before.join()

        def show(what: str, done: int, total: int, detail: str) -> None:
            if self._wanted != wanted:
                raise SupersededError
            self.progress = what, done, total, detail

        wrong, shown = "", self.shown
        try:
            try:
                self._update(show)
            except StudyError as error:
                wrong = str(error)
            if BEFORE in self.results:
                named = {piece.item: piece for piece in pieces_of(self.results[BEFORE], self.law)}
                self.pieces = [named[str(item)] for item in self.results[BEFORE]["block"].values]
                shown = self.render("result")
        except SupersededError:
            return
        except Exception as error:  # (a page must not wait for ever)
            wrong = f"{type(error).__name__}: {error}"
        with self.lock:
            if self._wanted == wanted:
                self.wrong, self.shown, self.progress, self.version = wrong, shown, None, self.version + 1

    def _update(self, show: Callable[[str, int, int, str], None]) -> None:
        """Run each study whose files have changed as `toppling run` does."""
        with self.lock:
            files = self.files
        for name in {*self.results} - {*files}:
            del self.results[name], self._of[name]
        for name, texts in files.items():
            show(name, 0, 0, "")
            if name not in self.results or self._of[name] != texts:  # (an error leaves no results)
                self.results.pop(name, None)
                study, out, resume = Study.from_toml(self.file(name)), self.file(name, ".results"), True
                study.prepare()
                try:
                    study.refuse_occupied(out)
                except StudyError:  # (results of the table before a change)
                    resume = False
                display = Display(show, name, study.aside)
                results = study.run(out, self.memory, resume, progress=display.update, watching=display.watching)
                self.results[name], self._of[name] = results, texts

    def answer(self, version: int) -> dict[str, Any]:
        """Return progress, what is wrong with its cell, and the parts that a page of an earlier version lacks."""
        with self.lock:
            if self.sheet is not None and self._thread is None and not self.stopped:
                self._begin()
            table, parts, cell = str(self.file(BEFORE, ".csv")), {}, ""
            if self.sheet is not None and self.wrong.startswith(table):
                line, cell = self.sheet.place(self.wrong.removeprefix(table))
                if line is not None and not self.first <= line < self.first + MOST_LINES:
                    self.first = line // MOST_LINES * MOST_LINES
                    parts["sheet"] = self.render("sheet")
            if version != self.version:
                parts["result"] = self.shown
            parts["progress"] = self.render("progress")
            now = {"running": self.progress is not None and not self.stopped, "stopped": self.stopped}
            wrong = {"wrong": self.wrong.removeprefix(f"{table}, "), "cell": cell}
            return {"version": self.version, "parts": parts, **now, **wrong}

    def text(self, what: str, name: str) -> bytes:
        """Return a study file, or a report, which `toppling report` writes into the folder of the study's results."""
        if what not in ("study", "report") or name not in (self.files if what == "study" else self.results):
            raise StudyError(f"the page has no {what[:20]!r} of {name[:20]!r}")
        if what == "study":
            return self.files[name][0]
        (page,) = write_report(self.file(name, ".results") / RESULT_NAME)
        return page.read_bytes()

    # --- parts

    def render(self, name: str) -> str:
        """Return a part of the page, or the page, from its template."""
        anchored = {line: cells["anchored"] for line, cells in self.ticks.items() if "anchored" in cells}
        of_page = {"page": self, "before": self.results.get(BEFORE), "anchored": anchored, "state": state}
        constants = {"most_bytes": KIND.most_bytes, "most_lines": MOST_LINES, "columns": COLUMNS, "names": FIELDS}
        with noted():
            return Markup(page_templates().get_template(f"building_{name}.html.j2").render(of_page | constants))

    @property
    def floors(self) -> list[str]:
        """The floors onto which a piece can be moved."""
        storeys = state.value_at(self.content, "building.storeys")
        known = range(min(storeys, 300) + 1) if isinstance(storeys, int) else self.results[BEFORE]["floor"].values
        return list(dict.fromkeys(map(str, known)))

    @property
    def law(self) -> int:
        """Position of the law of the answer."""
        return reference_law(self.results[BEFORE])[0]

    def ranking(self) -> tuple[list[str], list[tuple[int, list[str], str, bool]]]:
        """Return the headings, and of each piece by its chance: line, cells, chance after, and if it cannot fall."""
        results, after = self.results[BEFORE].assign_attrs(sort="chance"), self.results.get(AFTER)
        table, held = pieces(results, self.law), [piece.held for piece in self.pieces]
        places = {str(item): i for i, item in enumerate(results["block"].values)}
        lines = [places[str(item)] for item in table.column("item")]
        later = [""] * len(places)
        if after is not None:  # (a piece that is moved may have another name)
            of = pieces(after, self.law)
            chances = dict(zip(map(str, of.column("item")), of.texts("chance"), strict=True))
            later = [chances[str(item)] for item in after["block"].values]
        shown = table.only(*RANKED)
        rows = [(i, shown.cells(row), later[i], held[i]) for i, row in zip(lines, shown.lines, strict=True)]
        return [column.heading for column in shown.columns], rows[:MOST_LINES]

    @property
    def answers(self) -> dict[str, list[str]]:
        """The sentences of the answer of each report, and the range of its model."""
        answers = {}
        for name, results in self.results.items():
            by_section = sections(with_law_names(results))
            ranges = [fact for fact in by_section["footnotes"] if fact.what == "rate.model_range"]
            facts_of = {"answer": by_section["answer"], "footnotes": ranges}
            answers[name] = [say(fact, REGISTERS[section]) for section, facts in facts_of.items() for fact in facts]
        return answers

    def compared(self) -> Table:
        """Return the table of the whole building before (A) and after (B), as `toppling compare` has it."""
        both = [(letter, name, self.results[name]) for letter, name in (("A", BEFORE), ("B", AFTER))]
        sides = [Side(letter, self.file(name), results, study_of(results)) for letter, name, results in both]
        law = str(self.results[BEFORE]["model"].values[self.law])
        compared = compare_pieces(sides[0], sides[1], (law, law))
        whole = [quantity for quantity in compared.quantities if quantity.whole]
        return table_of(compared.lines, whole, confidence_text(self.results[BEFORE]))

    def cost(self, held: Mapping[int, str]) -> tuple[float, int]:
        """Return the cost of anchoring lines, each for good or with a kit, and the number of unknown costs."""
        every, costs = self.pieces, []
        for line, kit in held.items():
            tried = [effect.cost for effect in every[line].tried if effect.kit == kit]
            costs.append(tried[0] if tried else every[line].cost_of_all)
        return math.fsum(cost for cost in costs if math.isfinite(cost)), sum(map(math.isnan, costs))

    @property
    def chosen(self) -> dict[int, str]:
        """The lines of the best set for the budget, and what anchors them."""
        of_law = self.results[BEFORE].isel(model=self.law) if BEFORE in self.results else {}
        if "budget_kit" in of_law:
            return {i: str(kit) for i, kit in enumerate(of_law["budget_kit"].values) if kit}
        flags = of_law["budget_chosen"].values if "budget_chosen" in of_law else np.zeros(0)
        return {i: "yes" for i, is_chosen in enumerate(flags) if is_chosen}

    @property
    def dearest(self) -> int:
        """Cost of anchoring all pieces, the end of the slider; 0 if no cost is given."""
        free = [piece for piece in self.pieces if not piece.held]
        costs = [max([piece.cost_of_all, *(kit.cost for kit in piece.tried)], key=np.nan_to_num) for piece in free]
        return math.ceil(math.fsum(cost for cost in costs if math.isfinite(cost)))


def start_content() -> dict[str, Any]:
    """Return the study with which a page without a study begins: the place and the shaking of the page of a piece."""
    piece = state.start_state()
    del piece["building"]["floors"], piece["hazard"]["years"]
    spread = {"restitution_sd": 0.03, "slenderness_dispersion": 0.05}
    asked = {"inventory": "", "variability": spread, "im": "pga", "levels": piece["ida"]["levels"]}
    content = {"title": "Contents of a building", "models": [{"law": "housner", "geometry": "bilinear"}]}
    return {**content, "performance": asked, **{name: piece[name] for name in ("motions", "building", "hazard")}}


def _sheet(path: Path) -> Sheet:
    return Sheet.read(path.name, whole_content(path, KIND.most_bytes, KIND.name, StudyError))
