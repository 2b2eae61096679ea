"""A building full: cells, ticks and the budget as files, runs in the background, and numbers as of the commands."""

import json
import random
import re
import shutil
import time
import tomllib

import pytest
from asgi import HOST, PORT, TOKEN, ask

import toppling as tp
from toppling.studies.app import state
from toppling.studies.command.cli import main
from toppling.studies.inventory.reading import KIND, example_path

pytest.importorskip("starlette", reason="needs the extra app")

from toppling.studies.app.building import AFTER, BEFORE, Building, start_content
from toppling.studies.app.page import Page
from toppling.studies.app.server import HEADERS, MOST_BYTES, OF_REPORT, application

TABLE = b"""item,catalogue,floor,count,value,currency,consequence,anchored,anchoring_cost,mass_kg
shelf,bookcase-6-shelf,3,2x,400,EUR,injury,no,30,90
cabinet,file-vertical-4-drawer,1,4,300,EUR,,no,25,80
rack,server-rack-42u,2,1,9000,EUR,records,no,220,300
cylinder,gas-cylinder-large,0,3,250,EUR,release,yes,25,80
"""
MENDED = "cell.0-3"
HASH = re.compile("[0-9a-f]{62,64}")


def small_content():
    """A study that takes a moment."""
    content = start_content()
    content["motions"] |= {"number": 8, "dt_s": 0.02}
    content["performance"]["levels"] = {"values": [0.2, 0.6, 1.5], "unit": "g"}
    content["performance"]["variability"] |= {"variants": 4}
    return content


def opened(folder, content=None, table=None):
    """The page of a study in a folder, with its table if one is given."""
    content = content or small_content()
    content["performance"]["inventory"] = "building.live.csv"
    file = folder / state.BUILDING_STATE
    file.write_text(state.toml_of(content), encoding="utf-8")
    if table is not None:
        file.with_suffix(".csv").write_bytes(table)
    return Building.opened(file, given=False)


def finished(page):
    """Return the answer of a page once its runs have ended."""
    end = time.monotonic() + 300.0
    while page.progress is not None and time.monotonic() < end:
        time.sleep(0.02)
    return page.answer(page.version)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("building")


@pytest.fixture(scope="module")
def page(folder):
    """A page with a mended table, a budget, a piece that is anchored and one that is moved."""
    made = opened(folder)
    made.drop("table.csv", TABLE)
    wrong = finished(made)
    assert wrong["cell"] == "0-3"
    assert wrong["wrong"] == "line 2, column 'count': must be a whole number, got '2x'"
    made.change(MENDED, "2")
    assert finished(made)["wrong"] == ""
    return made


@pytest.fixture(scope="module")
def app(page, folder):
    state.write_state(folder / state.PIECE_STATE, {state.PIECE: state.start_state()})
    return application(Page.opened(folder / state.PIECE_STATE, given=True), TOKEN, PORT, page)


@pytest.mark.slow
def test_ticks_need_no_runs_and_give_the_numbers_of_the_command(page, folder, capsys):
    ran = page.memory.ran
    page.change("anchored.1", "yes")
    finished(page)
    assert page.memory.ran == ran
    page.change("floor.0", "0")  # (a piece on another floor is run there)
    page.change("budget", "60")
    assert finished(page)["wrong"] == ""
    assert page.memory.ran > ran
    again = Building.opened(page.path, given=True)
    assert (again.ticks, again.content) == (page.ticks, page.content)
    assert again.ticks == {1: {"anchored": "yes"}, 0: {"floor": "0"}}
    result = page.render("result")
    for name in (BEFORE, AFTER):
        file, out = page.file(name), folder / f"command {name}"
        assert main(["run", str(file), "--out", str(out)]) == 0
        assert tp.Study.from_toml(file).run().identical(page.results[name])
        capsys.readouterr()
        assert main(["report", str(out), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        for fact in said["answer"]:
            assert fact["sentence"] in result.replace("&amp;", "&").replace("&#39;", "'"), fact
        assert main(["report", str(out)]) == 0
        printed, place = page.text("report", name).decode(), page.file(name, ".results")
        # (apart from the place and the hash of the file, which was decided again for the budget)
        of_command = (out / "report.html").read_text("utf-8").replace(str(out), "")
        assert HASH.sub("", printed.replace(str(place), "")) == HASH.sub("", of_command)
    outs = [str(folder / f"command {name}") for name in (BEFORE, AFTER)]
    capsys.readouterr()
    assert main(["compare", *outs, "--out", str(folder / "compared"), "--json"]) == 0
    tables = {table["title"]: table for table in json.loads(capsys.readouterr().out)["tables"]}
    shown = page.compared()
    whole = tables[shown.title]
    assert [[*line.values()] for line in whole["rows"]] == [[*line.values()] for line in _json(shown)["rows"]]


def _json(table):
    from toppling.studies.tables.files import table_json

    return json.loads(json.dumps(table_json(table)))


@pytest.mark.slow
def test_ranks_costs_and_the_best_set(page):
    page.change("budget", "60")
    finished(page)
    headings, ranking = page.ranking()
    assert headings[0] == "piece"
    chances = {piece.item: piece.chance.value for piece in page.pieces if not piece.held}
    ranked = [cells[0] for _, cells, _, held in ranking if not held]
    assert ranked == sorted(chances, key=lambda item: -chances[item])
    assert [held for *_, held in ranking] == [False, False, False, True]
    assert page.dearest == 2 * 30 + 4 * 25 + 220
    sum_of_set, unknown = page.cost(page.chosen)
    assert 0.0 < sum_of_set <= 60.0
    assert unknown == 0
    page.change("take", "")
    assert finished(page)["wrong"] == ""
    assert {line: cells["anchored"] for line, cells in page.ticks.items() if "anchored" in cells} == page.chosen
    for line in list(page.ticks):
        page.change(f"anchored.{line}", "")
        page.change(f"floor.{line}", "")
    finished(page)
    assert {*page.results} == {BEFORE}
    assert not page.file(AFTER).exists()


@pytest.mark.slow
def test_a_mistake_that_is_taken_back_leaves_no_page_without_results(page):
    shown, names = page.shown, {*page.results}
    for text, wrong in (("2x", True), ("2", False)):
        page.change(MENDED, text)
        assert bool(finished(page)["wrong"]) == wrong
    assert page.shown == shown
    assert {*page.results} == names != set()


def test_stop_and_continue(tmp_path):
    content = small_content()
    content["motions"]["number"] = 100
    page = opened(tmp_path, content, TABLE.replace(b"2x", b"2"))
    assert page.answer(0)["running"]
    page.change("run", "stop")
    answer = page.answer(0)
    assert answer["stopped"]
    assert "Stopped" in answer["parts"]["progress"]
    page._thread.join(120)
    assert page.results == {}
    page.change("run", "go")
    assert finished(page)["wrong"] == ""
    assert {*page.results} == {BEFORE}


def test_a_table_of_another_study_is_shown(tmp_path):
    """The study's own files stay as they are."""
    shutil.copy(example_path(), tmp_path / "inventory.csv")
    content = {**small_content(), "title": "<b>A clinic</b>"}
    content["performance"]["inventory"] = "inventory.csv"
    file = tmp_path / "clinic.toml"
    file.write_text(state.toml_of(content), encoding="utf-8")
    page = Building.opened(file, given=True)
    assert page.path.name == "clinic.live.toml"
    assert len(page.sheet.lines) == 14
    page._work = lambda *_: None
    page.change("cell.0-0", "<script>alert(1)</script>")
    assert {path.name for path in tmp_path.iterdir()} == {
        *("clinic.toml", "inventory.csv", "clinic.live.toml", "clinic.live.csv")
    }
    assert (tmp_path / "inventory.csv").read_bytes() == open(example_path(), "rb").read()  # noqa: SIM115
    assert "<script>" not in page.render("page")
    assert tomllib.loads(page.path.read_text("utf-8"))["performance"]["sort"] == "chance"


def test_uploads_are_bounded_and_refused_with_a_sentence(app, page, folder):
    before = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    large = [(b"content-length", b"104857600")]
    status, _, text = ask(app, f"/{TOKEN}/building/drop", b"", length=False, headers=large, method="POST")
    assert (status, text) == (413, f"A request may have at most {KIND.most_bytes:,} bytes.")
    plain = [(b"content-type", b"application/octet-stream")]
    unnamed = ask(app, f"/{TOKEN}/building/drop", b"a" * (KIND.most_bytes + 1), length=False, headers=plain)
    assert unnamed[0] == 413
    assert ask(app, f"/{TOKEN}/building/change", b"a" * (MOST_BYTES + 1))[0] == 413
    multipart = b'--x\r\nContent-Disposition: form-data; name="file"; filename="../../a"\r\n\r\nPK'
    kinds = [[(b"content-type", kind)] for kind in (b"application/octet-stream", b"multipart/form-data; boundary=x")]
    for content in (b"", b"\0" * 100, b"PK\3\4" + b"\xff" * 1000, b"item,floor\n\xff,0\n", b'"', multipart):
        for name in ("a.xlsx", "a.csv", "../../../etc/passwd", "C:\\x.csv", "", "%00", "\r\nx: y", "a" * 5000):
            query = f"name={name}".encode("utf-8", "replace") if name.isprintable() else b"name=%0d%0ax"
            for kind in kinds:
                status, _, text = ask(app, f"/{TOKEN}/building/drop", content, headers=kind, query=query)
                assert status == 422, (content, name)
                assert len(json.loads(text)["said"].splitlines()) == 1
    for address in ("change", "drop"):
        for token in ("", "wrong/"):
            assert ask(app, f"/{token}building/{address}", b"{}")[0] == 403
        assert ask(app, f"/{TOKEN}/building/{address}", b"{}", headers=[(b"origin", b"http://a.b")])[0] == 403
        assert ask(app, f"/{TOKEN}/building/{address}", b"{}", host="a.b")[0] == 403
    assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == before


@pytest.mark.slow
def test_a_thousand_hostile_changes(app, page, folder):
    """Each is one sentence, and nothing but the state of the page is written."""
    names = {file.name for file in folder.iterdir()}
    content, sheet, ticks = json.dumps(page.content), page.sheet, dict(page.ticks)
    draw = random.Random(60)
    texts = ["", "-1", "nan", "1e999", "0x10", "٣", "9" * 5000, "<b>", "{{7*7}}", "../../etc/passwd", "\0", "\ud800"]
    paths = [
        *("budget", "building.storeys", "building.period_s", "motions.magnitude", "hazard.0", "hazard.99", "hazard.x"),
        *("cell.99-0", "cell.0-99", "cell.-1-0", "cell.h-0", "remove.99", "anchored.99", "floor.x", "lines", "column"),
        *("performance.inventory", "motions.records", "title", "__class__", "", "..", "a" * 5000, "take.x"),
    ]
    wrong = {"budget": texts[1:], "cell.h-0": ["x" * 500, "floor"]}
    for _ in range(1000):
        path = draw.choice(paths)
        text = draw.choice(wrong.get(path, texts))
        if text == "-1" and path.partition(".")[0] in ("budget", "building", "motions"):
            continue  # (a number, which the study refuses)
        status, _, said = ask(app, f"/{TOKEN}/building/change", {"path": path, "value": text})
        assert status in (200, 413, 422), (path, text)
        if status != 200:
            assert "\n" not in (json.loads(said)["said"] if status == 422 else said)
    assert {file.name for file in folder.iterdir()} <= names | {f"building.live.{end}" for end in ("toml", "csv")}
    assert (json.dumps(page.content), page.sheet, page.ticks) == (content, sheet, ticks)


def test_headers_and_what_is_not_there(app):
    for path in ("building", "building/state", "building/study/before", "building/study/x", "building/x/before"):
        status, headers, text = ask(app, f"/{TOKEN}/{path}", query=b"version=0")
        assert status == (422 if "x" in path else 200), path
        for name, value in HEADERS.items():
            assert headers[name.lower()] == value
        assert "style=" not in text
    assert ask(app, f"/{TOKEN}/building/report/../../x")[0] == 404
    assert ask(app, f"/{TOKEN}/building/state", query=b"version=x")[0] == 422


@pytest.mark.slow
def test_a_report_has_its_own_policy(app, page):
    status, headers, text = ask(app, f"/{TOKEN}/building/report/before")
    assert status == 200
    assert headers["content-security-policy"] == OF_REPORT["Content-Security-Policy"]
    assert "script" not in headers["content-security-policy"]
    assert text.startswith("<!")
    assert HOST not in text


@pytest.mark.slow
def test_kits_of_the_study_hold_what_is_ticked(tmp_path):
    """The best set for the budget names kits; the study after it has only the restraints that its table names."""
    example = example_path().replace("inventory.csv", "kits.toml")
    content = tomllib.loads(open(example, encoding="utf-8").read())  # noqa: SIM115
    content["motions"] |= {"number": 20, "dt_s": 0.02}
    content["performance"]["levels"]["number"] = 3
    (tmp_path / "kits.toml").write_text(state.toml_of(content), encoding="utf-8")
    shutil.copy(example.replace(".toml", ".csv"), tmp_path)
    page = Building.opened(tmp_path / "kits.toml", given=True)
    assert page.answer(0)["running"]
    finished(page)
    assert page.chosen == {1: "bracket"}
    assert page.cost(page.chosen) == (120.0, 0)
    page.change("take", "")
    assert finished(page)["wrong"] == ""
    after = tomllib.loads(page.file(AFTER).read_text("utf-8"))
    assert [*after["restraints"]] == ["bracket"]
    assert not {"budget", "target", "kits"} & {*after["performance"]}
    assert page.results[AFTER]["anchored_with"].values[1] == "bracket"
    for line in range(len(page.sheet.lines)):
        page.change(f"anchored.{line}", "yes")
    assert "nothing is left to be anchored" in finished(page)["wrong"]


def test_other_lines_end_the_earlier_results(tmp_path):
    """A tick in results of the earlier table would be of another line."""
    page = opened(tmp_path, None, TABLE)
    page._work = lambda *_: None
    page.shown = "earlier results"
    page.change("anchored.2", "yes")
    page.change("floor.1", "0")
    assert page.shown
    parts = page.change("remove.0", "")
    assert (parts["result"], page.shown) == ("", "")
    assert page.ticks == {1: {"anchored": "yes"}, 0: {"floor": "0"}}
    assert [page.sheet.cell(line, "item") for line in page.ticks] == ["rack", "cabinet"]
    with pytest.raises(ValueError, match="wait until the runs"):
        page.change("take", "")
    again = Building.opened(page.path, given=True)
    assert (again.ticks, again.sheet) == (page.ticks, page.sheet._replace(doubts=[]))
    page.change("anchored.1", "")
    page.change("floor.0", "1")  # (as in the table)
    assert page.ticks == {}
    assert not page.file(AFTER, ".csv").exists()
    assert page.drop("other.csv", TABLE)["result"] == ""


def test_a_state_with_a_wrong_value_opens_again(tmp_path):
    """The page has written a value before its runs refuse it: the next start shows it, and lets it be mended."""
    content = small_content()
    content["motions"]["magnitude"] = 9.0
    made = opened(tmp_path, content, TABLE.replace(b"2x", b"2"))
    made.answer(0)  # (begins the runs)
    assert "motions.magnitude" in finished(made)["wrong"]
