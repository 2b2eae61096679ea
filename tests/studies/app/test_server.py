"""The server of the live page: who may ask, what is refused with one sentence, and numbers as of the saved study."""

import json
import random
import tomllib

import pytest
from asgi import HOST, PORT, TOKEN, ask

import toppling as tp
from toppling.studies.app import state
from toppling.studies.command.cli import main

pytest.importorskip("starlette", reason="needs the extra app")

from toppling.studies.app import answers
from toppling.studies.app.page import Page
from toppling.studies.app.server import HEADERS, MOST_BYTES, application


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
    state.write_state(file, answers.contents_of(small_state()))
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
            status, _, said = ask(app, f"/{TOKEN}/change", b"a" * 10, headers=large, length=False)
        else:
            chosen = draw.choice([multipart, multipart * 40, b"a" * (MOST_BYTES + 1)])
            headers = [(b"content-type", b"multipart/form-data; boundary=x")]
            status, _, said = ask(app, f"/{TOKEN}/change", chosen, headers=headers, length=bool(number % 3))
        assert status in (413, 422), (kind, status, said[:200])
        assert len(said) < 700
        assert "Traceback" not in said
        assert "\n" not in said
        statuses.add(status)
    assert statuses == {413, 422}
    assert json.dumps(page.content) == content
    assert {file.name: file.read_bytes() for file in folder.iterdir()} == before


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


@pytest.mark.slow
@pytest.mark.parametrize("edits", [[], [("wall", "yes"), ("blocks.0.restraint", "strap"), ("building.floors", "2")]])
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
    assert ask(app, f"/{TOKEN}/save", {"name": name})[0] == 200
    full = page.full.results
    for kind in ("piece", "earthquake", "remedies"):
        file = state.file_of(folder / f"{name}.toml", kind)
        assert main(["run", str(file), "--out", str(folder / f"{name} {kind}")]) == 0
        results = tp.Study.from_toml(file).run()
        kept = full[kind]
        assert results.identical(kept), kind
        capsys.readouterr()
        assert main(["report", str(folder / f"{name} {kind}"), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        if kind == "piece":
            for fact in [*said["answer"], *said["footnotes"]]:
                sentence = fact["sentence"].replace("“", "“")
                assert sentence.replace("&", "&amp;") in parts["basis"], sentence
            reference = results.isel(block=0, model=0).squeeze()
            assert float(reference["risk_probability"]) == quick.chance
            assert float(reference["rate"]) == quick.rate
            assert page.full.curve.shares == quick.curve.shares
            assert page.full.curve.seen == quick.curve.seen


@pytest.mark.slow
def test_two_variants_are_compared_as_the_command_does(app, page, folder, capsys):
    assert ask(app, f"/{TOKEN}/variant", {"what": "keep"})[0] == 200
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
    assert page.variant == ""


@pytest.mark.slow
def test_feet_show_what_slides(app, page):
    assert ask(app, f"/{TOKEN}/change", {"path": "blocks.0.restraint", "value": ""})[0] == 200
    assert ask(app, f"/{TOKEN}/change", {"path": "wall", "value": "no"})[0] == 200
    before = page.complete(page.version)
    assert page.sliding == []
    assert ask(app, f"/{TOKEN}/change", {"path": "feet", "value": "vinyl"})[0] == 200
    after = page.complete(page.version)
    assert page.sliding[0].title in after["answer"]
    assert page.full.results["piece"].attrs["title"]
    assert "Sliding" not in before["answer"].split("</table>")[1]
    assert ask(app, f"/{TOKEN}/change", {"path": "feet", "value": ""})[0] == 200


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
    assert {*first} == {"answer", "curve", "basis"}
    assert {*page.full.results} == {"piece", "earthquake"}
    rest = page.complete(page.version, "rest")
    assert first["answer"] == rest["answer"]
    assert "two brackets" in rest["remedies"]
    assert page.complete(page.version - 1, "rest") is None


def test_later_changes_stop_earlier_answers(page):
    assert page.complete(page.version - 1) is None


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
