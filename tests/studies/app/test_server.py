"""The server of the live page: who may ask, what is refused with one sentence, and numbers as of the saved study."""

import asyncio
import json
import random
import socket
import threading
import time
import tomllib
import warnings
from http.client import HTTPConnection
from urllib.parse import quote, urlsplit

import numpy as np
import pytest
from asgi import HOST, PORT, TOKEN, ask

import toppling as tp
from toppling.fragility import probability_in
from toppling.studies.app import state
from toppling.studies.command.cli import main

pytest.importorskip("starlette", reason="needs the extra app")

from live_page import served

from toppling.studies.app import piece_studies, server
from toppling.studies.app.page import Page
from toppling.studies.app.server import HEADERS, MOST_BYTES, MOST_OF_FILE, application


def small_state():
    """A state whose studies take a moment."""
    content = state.start_state()
    content["motions"] |= {"number": 6, "dt_s": 0.02}
    content["ida"]["levels"] = {"values": [0.1, 0.3, 0.6, 1.2], "unit": "g"}
    content["models"] = content["models"][:2]
    content["fit"] = {"replicates": 100}
    return content


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("app")


@pytest.fixture(scope="module")
def page(folder):
    file = folder / "piece.live.toml"
    state.write_state(file, piece_studies.contents_of(small_state()))
    return Page.opened(file, given=True)


@pytest.fixture(scope="module")
def app(page):
    return application(page, TOKEN, PORT)


def test_only_with_the_token_from_this_host_and_origin(app):
    assert ask(app, f"/{TOKEN}/")[0] == 200
    for path in (
        "/",
        "",
        "/static/app.js",
        f"/{TOKEN}",
        f"/{TOKEN}x/",
        "/wrong/",
        f"//{TOKEN}/",
        "/é/",
        f"/{TOKEN[:-1]}/",
    ):
        assert ask(app, path)[0] == 403, path
    for host in ("example.org", "127.0.0.1", "127.0.0.1:1", "localhost", f"{HOST}.example.org", ""):
        assert ask(app, f"/{TOKEN}/", host=host)[0] == 403, host
    for origin in (b"http://example.org", b"null", b"https://127.0.0.1:8000", b"http://127.0.0.1"):
        assert ask(app, f"/{TOKEN}/change", {}, headers=[(b"origin", origin)])[0] == 403, origin
    assert ask(app, f"/{TOKEN}/", headers=[(b"origin", f"http://{HOST}".encode())])[0] == 200


def test_headers_and_files(app):
    for path in ("", "static/app.css", "static/app.js", "static/icon.svg", "study/piece", "nothing"):
        status, headers, _ = ask(app, f"/{TOKEN}/{path}")
        assert status == (404 if path == "nothing" else 200), path
        for name, value in HEADERS.items():
            assert headers[name.lower()] == value, (path, name)
    _, _, text = ask(app, f"/{TOKEN}/")
    assert "<script>" not in text
    assert "style=" not in text
    assert " onclick" not in text


def test_what_is_not_there(app, folder):
    for name in ("../pyproject.toml", "..%2f..%2fsetup.py", "app.py", "%00", "piece.toml", "../templates/page.html.j2"):
        assert ask(app, f"/{TOKEN}/static/{name}")[0] == 404, name
    for name in ("../x", "setup", "piece.toml", ""):
        status, _, text = ask(app, f"/{TOKEN}/study/{name}")
        assert status in (404, 422)
        assert "\n" not in text
    assert ask(app, f"/{TOKEN}/begin", method="DELETE")[0] == 405


def test_an_address_with_a_slash_too_many_leads_to_its_page(app):
    status, headers, _ = ask(app, f"/{TOKEN}/building/")
    assert (status, headers["location"]) == (307, f"http://{HOST}/{TOKEN}/building")


def test_a_key_without_a_page_is_quoted(app):
    for at in ("change", "building/change"):
        for path in ("", "a\nb", "\x1b[31m"):
            status, _, text = ask(app, f"/{TOKEN}/{at}", {"path": path, "value": "1"})
            said = json.loads(text)["said"]
            assert status == 422
            assert said.startswith(repr(path))
            assert said.isprintable()


@pytest.mark.parametrize("name", ["a\x00b", "\x1b[31m", "a\u202eb", "\ud800", "a\x7fb"])
def test_a_name_that_no_study_can_have_is_refused(app, page, name):
    """The state would have it, and the page could not start again."""
    before = page.path.read_bytes()
    status, _, text = ask(app, f"/{TOKEN}/change", {"path": "blocks.0.name", "value": name})
    assert status == 422
    assert json.loads(text)["said"].startswith("name holds the control character U+")
    assert page.path.read_bytes() == before


@pytest.mark.parametrize(
    ("name", "kept"),
    [
        ("shelf\t12", "shelf 12"),
        ("two\r\nlines\u2028", "two lines"),
        ("Bücherregal № 4 – “oben”", "Bücherregal № 4 – “oben”"),
        ("棚 مكتبة", "棚 مكتبة"),
        ("👨\u200d👩\u200d👧 e\u0301", "👨\u200d👩\u200d👧 e\u0301"),
        ("<b>{{7*7}}'''\\", "<b>{{7*7}}'''\\"),
    ],
)
def test_other_names_are_kept_and_read_again(app, page, name, kept):
    assert ask(app, f"/{TOKEN}/change", {"path": "blocks.0.name", "value": name})[0] == 200
    assert Page.opened(page.path, given=True).value("blocks.0.name") == kept
    assert ask(app, f"/{TOKEN}/change", {"path": "blocks.0.name", "value": "bookcase"})[0] == 200


@pytest.mark.slow
@pytest.mark.parametrize("path", ["change", "building/drop?name=x.csv", "begin"])
def test_a_broken_request_leaves_no_traceback(tmp_path, path):
    """Its answer cannot be sent, because the server has answered already."""
    with served(tmp_path) as address:
        place = urlsplit(address)
        head = f"POST {place.path}{path} HTTP/1.1\r\nHost: {place.netloc}\r\nTransfer-Encoding: chunked\r\n"
        for _ in range(5):
            with socket.create_connection(("127.0.0.1", place.port), timeout=60) as connection:
                connection.sendall(f"{head}Content-Type: application/octet-stream\r\n\r\nzz\r\nabc\r\n".encode())
                connection.shutdown(socket.SHUT_WR)
                assert connection.recv(1000).startswith(b"HTTP/1.1 4")


@pytest.mark.slow
def test_two_thousand_hostile_requests(app, page, folder):
    """Each is refused with one sentence; nothing is written, and the state stays."""
    before = {file.name: file.read_bytes() for file in folder.iterdir()}
    content = json.dumps(page.content)
    draw = random.Random(60)
    texts = [
        *("", "abc", "-1", "nan", "inf", "1e999", "0x10", "1_0", "٣", "1,5", "9" * 5000, "<b>", "${7*7}", "{{7*7}}"),
        *(
            "../../etc/passwd",
            "/etc/passwd",
            "C:\\x",
            "\x00",
            "\r\nSet-Cookie: a=b",
            "'; DROP TABLE",
            "\ud800",
            "😀" * 300,
        ),
    ]
    paths = [
        *("blocks.0.width_m", "blocks.0.height_m", "blocks.0.wall_gap_mm", "blocks.0.catalogue", "blocks.0.restraint"),
        *("building.floors", "building.storeys", "hazard.levels.0", "hazard.levels.99", "motions.magnitude", "length"),
        *("__class__", "blocks.9.width_m", "blocks.-1.width_m", "include", "hazard.file", "motions.records", "target"),
        *("restraints.strap.cost.x", "restraints..cost", "a" * 3000, "", ".", "..", "blocks", "title", "\x00"),
    ]
    spoilt = [b"", b"[]", b"nul", b"{", b"[" * 9000, b'{"path": 1}', b"\xff\xfe", b"null", b"1e9", b'{"a": {"b": "c"}}']
    multipart = b'--x\r\nContent-Disposition: form-data; name="file"; filename="../../x"\r\n\r\n' + b"a" * 500
    statuses = set()
    for number in range(2000):
        kind = number % 8
        if kind < 3:
            path, text = draw.choice(paths), draw.choice(texts)
            if (path, text) in {("blocks.0.wall_gap_mm", "")} or (path == "blocks.0.catalogue" and not text):
                text = "abc"
            if path == "blocks.0.restraint" and not text:
                text = "x"
            body = json.dumps({"path": path, "value": text}).encode()
            status, _, said = ask(app, f"/{TOKEN}/change", body)
        elif kind == 3:
            status, _, said = ask(app, f"/{TOKEN}/change", draw.choice(spoilt))
        elif kind == 4:
            names = ["../x", "/tmp/x", "", ".", "a" * 100, "piece.live", "x\x00", "con/", "é", "<b>", "piece.live.toml"]
            status, _, said = ask(app, f"/{TOKEN}/save", {"name": draw.choice(names)})
        elif kind == 5:
            query = draw.choice([b"", b"level=-1&motion=0", b"level=99&motion=0", b"level=a", b"level=1&motion=1e9"])
            status, _, said = ask(app, f"/{TOKEN}/{draw.choice(['film', 'complete'])}", query=b"version=x&" + query)
        elif kind == 6:
            large = [
                (b"content-length", draw.choice([b"100000000", b"-1", b"x", b"1e9", str(MOST_BYTES + 1).encode()]))
            ]
            at = draw.choice(["change", "hazard", "save", "variant"])
            status, _, said = ask(app, f"/{TOKEN}/{at}", b"a" * 10, headers=large, length=False)
        else:
            at = draw.choice(["change", "hazard"])
            chosen = draw.choice([*spoilt, multipart, multipart * 40, multipart[:70], b"a" * (MOST_OF_FILE + 1)])
            kinds = [b"multipart/form-data; boundary=x", b"multipart/form-data", b"\xff"]
            headers = [(b"content-type", draw.choice(kinds))]
            names = ["x.csv", "x.json", "../../x.csv", "/etc/passwd", "<b>.csv", "x\x00.csv", "", "é" * 300 + ".csv"]
            query = f"name={quote(draw.choice(names))}".encode()
            whole = number % 16 == 7
            status, _, said = ask(app, f"/{TOKEN}/{at}", chosen, None, headers, query, length=whole)
        assert status in (413, 422), (kind, status, said[:200])
        assert len(said) < 700
        assert "Traceback" not in said
        assert "\n" not in said
        statuses.add(status)
    assert statuses == {413, 422}
    assert json.dumps(page.content) == content
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


@pytest.mark.slow
@pytest.mark.parametrize("path", ["change", "hazard?name=x.csv"])
@pytest.mark.parametrize("chunked", [False, True])
def test_one_hundred_megabytes_over_the_wire(tmp_path, path, chunked):
    """The page answers or closes the connection early, goes on serving, and writes nothing."""
    with served(tmp_path) as address:
        place = urlsplit(address)
        connection = HTTPConnection(place.netloc, timeout=60)
        length = {} if chunked else {"Content-Length": "100000000"}
        sent = 0

        def parts():
            nonlocal sent
            for _ in range(100):
                sent += 1
                yield b"a" * 1_000_000

        try:
            connection.request("POST", place.path + path, parts(), length, encode_chunked=chunked)
            reply = connection.getresponse()
            assert reply.status == 413
            assert b"at most" in reply.read()
        except OSError:  # (it was closed before all was sent)
            assert sent < 100
        connection.close()
        other = HTTPConnection(place.netloc, timeout=60)
        other.request("GET", place.path + "study/piece")
        assert other.getresponse().status == 200
        assert {file.name for file in tmp_path.iterdir()} <= {"piece.live.toml"}


@pytest.mark.slow
def test_names_with_markup_are_text(app, page):
    name = "<img src=x onerror=alert(1)>\"'&"
    status, _, text = ask(app, f"/{TOKEN}/change", {"path": "blocks.0.name", "value": name})
    assert status == 200
    parts = json.loads(text)
    found = page.complete(parts["version"])
    for part in [*parts["parts"].values(), *found.values(), ask(app, f"/{TOKEN}/")[2]]:
        assert "<img" not in part
    assert "&lt;img" in parts["parts"]["form"]
    assert tomllib.loads(page.text("piece"))["blocks"][0]["name"] == name
    ask(app, f"/{TOKEN}/change", {"path": "blocks.0.name", "value": "bookcase"})


def same_numbers(numbers, results, kind):
    """The numbers of the ranges, which come before the results, are the results', bit for bit."""
    ends = ("", "_lower", "_upper", "_modelling_lower", "_modelling_upper")
    names = {"probability", "lower", "upper", "probability_modelling_lower", "probability_modelling_upper"}
    if "hazard" in json.loads(results.attrs["study"]):
        names |= {f"{name}{end}" for name in ("rate", "risk_probability") for end in ends}
    if "slides_instead" in results:
        names |= {"gated_probability"} | ({"gated_rate"} & {*results})
    if kind.endswith("restitution"):  # (of which the page shows no ranges)
        names &= {"probability", "rate", "risk_probability"}
    for name in names:
        case = results[name].isel({dim: 0 for dim in ("block", "floor") if dim in results[name].dims})
        np.testing.assert_array_equal(numbers[name].values, case.values, err_msg=f"{kind}: {name}")


@pytest.mark.slow
@pytest.mark.parametrize(
    "edits",
    [
        [],
        [("feet", "vinyl")],
        [("feet", ""), ("wall", "yes"), ("blocks.0.restraint", "strap"), ("building.floors", "2")],
    ],
)
def test_answers_are_those_of_the_command(app, page, folder, edits, capsys):
    """The quick answer, every number of the full one, and the sentences are of the saved study, run by the command."""
    for path, value in edits:
        status, _, said = ask(app, f"/{TOKEN}/change", {"path": path, "value": value})
        assert status == 200, said
    version = page.version
    page.parts()
    quick = page.quick
    parts = page.complete(version)
    name = f"kept {len(edits)}"
    shown = dict(page.ranges)
    assert ask(app, f"/{TOKEN}/save", {"name": name})[0] == 200
    full = page.full.results
    for kind in ("piece", "earthquake", "remedies", "restitution", "earthquake-restitution"):
        file = state.file_of(folder / f"{name}.toml", kind)
        assert main(["run", str(file), "--out", str(folder / f"{name} {kind}")]) == 0
        results = tp.Study.from_toml(file).run()
        if kind != "remedies":
            same_numbers(page.numbers[kind].chances, results, kind)
        if kind not in full:
            continue
        assert results.identical(full[kind]), kind
        capsys.readouterr()
        assert main(["report", str(folder / f"{name} {kind}"), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        if kind == "piece":
            for fact in [*said["answer"], *said["footnotes"]]:
                sentence = fact["sentence"].replace("“", "“")
                assert sentence.replace("&", "&amp;") in parts["basis"], sentence
            reference = results.isel(block=0, model=0).squeeze()
            assert float(reference["risk_probability"]) == float(quick.chances["risk_probability"].squeeze())
            assert float(reference["rate"]) == float(quick.chances["rate"].squeeze())
            assert page.numbers[kind].curve.shares == quick.curve.shares
            assert page.numbers[kind].curve.seen == quick.curve.seen
            assert shown["years"].value == float(reference["risk_probability"])
            assert (shown["years"].friction is None) == ("gated_rate" not in results)


@pytest.mark.slow
def test_two_variants_are_compared_as_the_command_does(app, page, folder, capsys):
    assert ask(app, f"/{TOKEN}/variant", {"what": "keep"})[0] == 200
    assert ask(app, f"/{TOKEN}/change", {"path": "blocks.0.wall_gap_mm", "value": "7"})[0] == 200
    assert "surroundings of the piece" in page.complete(page.version)["variants"]
    assert ask(app, f"/{TOKEN}/change", {"path": "blocks.0.width_m", "value": "37"})[0] == 200
    page.complete(page.version)
    page.save("what if")
    for name in ("what if", "what if.a"):
        assert main(["run", str(folder / f"{name}.toml"), "--out", str(folder / f"{name} results")]) == 0
    laws = [str(page.full.results[name]["model"].values[0]) for name in ("a", "piece")]
    paths = [str(folder / f"{name} results") for name in ("what if.a", "what if")]
    capsys.readouterr()
    assert main(["compare", *paths, "--laws", *laws, "--out", str(folder / "compared"), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    shown = page.full.compared.as_json
    for tables in (said["tables"], shown["tables"]):
        for table in tables:
            assert table["title"]
    plain = json.dumps(said["tables"]).replace("bookcase", "the piece")
    assert json.loads(plain) == json.loads(json.dumps(shown["tables"]))
    assert [fact["sentence"] for fact in said["answer"]] == [fact["sentence"] for fact in shown["answer"]]
    assert ask(app, f"/{TOKEN}/variant", {"what": "forget"})[0] == 200
    assert not (folder / "piece.live.a.toml").exists()
    assert "a" not in page.contents


@pytest.mark.slow
def test_feet_show_what_slides(app, page):
    assert ask(app, f"/{TOKEN}/change", {"path": "blocks.0.restraint", "value": ""})[0] == 200
    assert ask(app, f"/{TOKEN}/change", {"path": "wall", "value": "no"})[0] == 200
    before = page.complete(page.version)
    assert page.tables("slides") == []
    assert ask(app, f"/{TOKEN}/change", {"path": "feet", "value": "vinyl"})[0] == 200
    after = page.complete(page.version)
    assert page.tables("slides")[0].title in after["answer"]
    assert page.full.results["piece"].attrs["title"]
    assert "Sliding" not in before["answer"].split("</table>")[1]
    assert ask(app, f"/{TOKEN}/change", {"path": "feet", "value": ""})[0] == 200


@pytest.mark.slow
def test_a_law_that_restraints_cannot_have_leaves_them_out(app, page):
    """The rest of the full answer is there, and the comparison is back with the law."""
    assert ask(app, f"/{TOKEN}/change", {"path": "law.housner", "value": "no"})[0] == 200
    assert page.content["models"] == [{"law": "energy-consistent"}]
    parts = page.complete(page.version)
    assert "The piece and its hazard" in parts["basis"]
    assert "needs a hazard, the mass of the piece, and a damping law" in parts["remedies"]
    assert "remedies" not in page.contents
    status, _, said = ask(app, f"/{TOKEN}/change", {"path": "blocks.0.restraint", "value": "strap"})
    assert status == 422
    assert 'take the law "housner" (HousnerImpact) with geometry = "bilinear"' in json.loads(said)["said"]
    assert ask(app, f"/{TOKEN}/change", {"path": "law.housner", "value": "yes"})[0] == 200
    assert "two brackets" in page.complete(page.version)["remedies"]
    page.content["models"].reverse()


@pytest.mark.slow
def test_a_doubtful_rate_is_no_line_of_the_terminal(page, monkeypatch):
    """It is among the checks of the page."""
    page.complete(page.version)
    usual = piece_studies.Range.over

    def doubted(chances, years):
        probability_in(np.float64(383.0), years)
        return usual(chances, years)

    monkeypatch.setattr(piece_studies.Range, "over", doubted)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert {*page.chances()} == {"answer", "brief", "curve"}


@pytest.mark.slow
def test_the_script_gives_the_same_results(page, folder, monkeypatch):
    page.complete(page.version)
    (folder / "script").mkdir()
    monkeypatch.chdir(folder / "script")
    scope = {}
    exec(page.python("piece"), scope)
    assert scope["results"].identical(page.full.results["piece"])


@pytest.mark.slow
def test_ranges_come_before_restraints(page):
    first = page.complete(page.version, "ranges")
    assert {*first} == {"answer", "brief", "curve"}
    assert {*page.numbers} == {"piece", "earthquake", "restitution", "earthquake-restitution"}
    rest = page.complete(page.version, "rest")
    assert {*page.full.results} == {"piece", "earthquake", "remedies"}
    for name in ("brief", "curve"):
        assert first[name] == rest[name]
    table = slice(None, first["answer"].index("</table>"))
    assert first["answer"][table] == rest["answer"][table]
    assert "two brackets" in rest["remedies"]
    assert page.complete(page.version - 1, "rest") is None


def test_later_changes_stop_earlier_answers(page):
    assert page.complete(page.version - 1) is None


@pytest.mark.slow
@pytest.mark.parametrize("place", ["study_of", "full_of"])
def test_what_changes_while_an_answer_is_computed(page, monkeypatch, place):
    """A variant that is kept meanwhile is no error, and the state on the disk is that of the page."""
    page.studies, page.full, page.numbers_of = {}, None, -1
    usual = getattr(piece_studies, place)
    changed = []

    def meanwhile(*arguments):
        made = usual(*arguments)
        if not changed:
            changed.append(True)
            page.keep("keep")
            page.change("blocks.0.width_m", "44")
        return made

    monkeypatch.setattr(piece_studies, place, meanwhile)
    page.piece  # noqa: B018 - made before
    page.keep("forget")
    changed.clear()
    assert page.complete(page.version) is None
    assert changed
    assert tomllib.loads(page.path.read_text("utf-8"))["blocks"][0]["width_m"] == 0.44
    page.keep("forget")
    page.change("blocks.0.width_m", "30")


def test_without_the_extra_one_sentence_says_so(monkeypatch, capsys):
    monkeypatch.setattr("toppling.studies.app.command.NEEDED", ("no_such_package",))
    assert main(["app", "--no-browser"]) == 2
    assert capsys.readouterr().err == "toppling: the live page needs further packages: pip install 'toppling[app]'\n"


def test_wrong_ports_and_files(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["app", "missing.toml", "--no-browser"]) == 2
    assert main(["app", "--port", "70000", "--no-browser"]) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 2
    assert not [*tmp_path.iterdir()]


def test_the_end_waits_for_no_answer():
    """Ctrl-C ends the command although motions are made for a page that is open."""
    release, before = threading.Event(), {*threading.enumerate()}

    async def leave():
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(server.in_thread(release.wait, 60.0), 0.1)

    began = time.monotonic()
    asyncio.run(leave())
    assert time.monotonic() - began < 10.0
    assert [thread.daemon for thread in threading.enumerate() if thread not in before] == [True]
    release.set()


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            state.START.read_text(encoding="utf-8").replace('title = "A bookcase"', ""),
            "wrong.toml: key 'title' is missing",
        ),
        (
            state.START.read_text(encoding="utf-8").replace("magnitude = 6.8", "magnitude = [6.8]"),
            "wrong.toml: motions.magnitude",
        ),
        ('[performance]\ninventory = "office.csv"\n[motions]\nmagnitude = {}\n', "wrong.toml: "),
    ],
)
def test_a_wrong_study_is_one_sentence(tmp_path, monkeypatch, capsys, content, words):
    (tmp_path / "wrong.toml").write_text(content)
    monkeypatch.chdir(tmp_path)
    assert main(["app", "wrong.toml", "--no-browser"]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"toppling: {words}")
    assert len(error.splitlines()) == 1


CURVE = b"pga (g),rate (1/yr)\n0.05,4e-2\n0.2,4e-3\n0.8,2e-4\n"


@pytest.mark.slow
def test_a_dropped_hazard_file_is_kept_with_the_studies(app, page, folder):
    """The file that the reader of studies reads; a saved study keeps the content that it was saved with."""
    status, _, said = ask(app, f"/{TOKEN}/hazard", CURVE, query=b"name=site%20A.csv")
    assert status == 200, said
    name = page.value("hazard.file")
    assert (folder / name).read_bytes() == CURVE
    assert page.value("hazard.years") == 50
    quick = float(page.quick.chances["rate"].squeeze())
    page.save("dropped")
    results = tp.Study.from_toml(folder / "dropped.toml").run()
    assert float(results["rate"][0, 0].squeeze()) == quick
    assert name in page.python("piece")
    other = CURVE.replace(b"4e-3", b"5e-3")
    assert ask(app, f"/{TOKEN}/hazard", other, query=b"name=site%20A.csv")[0] == 200
    assert (folder / name).read_bytes() == CURVE
    assert float(page.quick.chances["rate"].squeeze()) != quick
    assert ask(app, f"/{TOKEN}/change", {"path": "hazard", "value": "points"})[0] == 200
    assert page.value("hazard.levels")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.csv", b"", "empty"),
        ("a.csv", b"\x00\xff" * 500, "a.csv"),
        ("a.csv", CURVE.replace(b"4e-3", b"-1"), "-1"),
        ("a.csv", CURVE.replace(b"4e-3", b"4e-1"), "rise"),
        ("a.csv", CURVE.replace(b"pga (g)", b"pgv (m/s)"), "pga"),
        ("a.csv", b"sheet,room\ndesk,12\n", "a.csv"),
        ("a.json", b"{", "a.json"),
        ("a.json", b"[" * 100_000, "a.json"),
        ("../../etc/passwd", CURVE, ".csv or .json"),
        ("<b>.xlsx", CURVE, ".csv or .json"),
        ("", CURVE, ".csv or .json"),
        ("a" * 5000 + ".csv", CURVE, ".csv or .json"),
    ],
)
def test_a_file_that_is_no_hazard_curve_is_one_sentence(app, page, folder, name, content, words):
    before = {file.name for file in folder.iterdir()}, json.dumps(page.content)
    query = f"name={quote(name)}".encode()
    status, _, text = ask(app, f"/{TOKEN}/hazard", content, query=query)
    said = json.loads(text)["said"]
    assert status == 422
    assert words in said
    assert len(said) < 500
    assert "\n" not in said
    assert "hazard-" not in said
    assert ({file.name for file in folder.iterdir()}, json.dumps(page.content)) == before
