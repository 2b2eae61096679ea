"""The state of the live page: edits of one key, units, and files that are read as they were written."""

import copy
import tomllib

import pytest

from toppling.models import LAWS, catalogue
from toppling.studies.app import piece_studies, state
from toppling.studies.file.json_schema import study_schema
from toppling.studies.file.schema import read_study_file
from toppling.studies.text.error import StudyError


@pytest.fixture
def start():
    return state.start_state()


@pytest.mark.parametrize(("text", "unit", "metres"), [("30", "cm", 0.3), ("300", "mm", 0.3), ("12", "in", 0.3048)])
def test_sizes_in_three_units(start, text, unit, metres):
    made = state.edited(start, "blocks.0.width_m", text, unit)
    assert made["blocks"][0]["width_m"] == pytest.approx(metres, rel=1e-12)
    assert state.field(made, "blocks.0.width_m", unit).value == text


def test_a_unit_beside_a_number_counts(start):
    assert state.edited(start, "blocks.0.width_m", "0.4 m", "cm")["blocks"][0]["width_m"] == 0.4
    made = state.edited(state.edited(start, "wall", "yes", "cm"), "blocks.0.wall_gap_mm", "1.5", "cm")
    assert made["blocks"][0]["wall_gap_mm"] == 15.0


@pytest.mark.parametrize(
    ("path", "text"),
    [
        *(("blocks.0.width_m", text) for text in ("", "abc", "-3", "nan", "inf", "1e999", "1,5", "5 kg", "9" * 300)),
        *(("building.storeys", text) for text in ("2.5", "x", "")),
        *(("building.floors", text) for text in ("-1", "1.5", "99999", "")),
        *(("hazard.levels.0", text) for text in ("0", "-1", "nan", "x")),
        ("hazard.levels.77", "1"),
        ("blocks.0.catalogue", "no such thing"),
        ("blocks.0.restraint", "no such thing"),
        *((path, "1") for path in ("blocks.0.e", "title", "", "..", "blocks.1.width_m", "restraints.strap.kind")),
        *((path, "1") for path in ("restraints.x.cost", "hazard.file", "motions.records", "__class__", "a" * 5000)),
    ],
)
def test_what_is_wrong_is_one_sentence(start, path, text):
    before = copy.deepcopy(start)
    with pytest.raises(StudyError) as caught:
        state.edited(start, path, text, "cm")
    assert "\n" not in str(caught.value)
    assert start == before


def test_a_size_is_a_number_alone_or_with_a_unit(start):
    """A unit of the page may stand next to its number; a number that is none is not asked for a unit."""
    for text in ("", "abc", "-", "1,5", "1.2.3", "-3", "-3 cm", "1e400", "5 kg", "nan m", "40c"):
        with pytest.raises(StudyError) as caught:
            state.edited(start, "blocks.0.width_m", text, "cm")
        assert str(caught.value) == f"width_m: must be a number >= 0, alone or with m, cm, mm or in, got {text!r}"
    for text in ("40", " 40 ", "4e1", "+40.", "0.4m", "0.4 m", "400 mm", "40cm"):
        assert state.edited(start, "blocks.0.width_m", text, "cm")["blocks"][0]["width_m"] == 0.4
    assert state.edited(start, "blocks.0.width_m", "20 in", "cm")["blocks"][0]["width_m"] == 0.508
    assert state.edited(start, "blocks.0.width_m", "20", "in")["blocks"][0]["width_m"] == 0.508


def test_a_size_of_no_block_is_one_sentence(start):
    start["blocks"][0]["width_m"] = 0.0
    with pytest.raises(StudyError, match=r"^width_m: must be > 0 [^\n]* got 0\.0$"):
        state.piece_of(start)


def test_an_item_of_the_catalogue_and_its_sizes(start):
    name = next(iter(catalogue))
    made = state.edited(start, "blocks.0.catalogue", name, "cm")
    piece, item = state.piece_of(made), catalogue[name]
    assert (piece.width, piece.height, piece.depth) == (item.width, item.height, item.depth)
    assert float(state.field(made, "blocks.0.width_m", "cm").value) == pytest.approx(100.0 * item.width)
    own = state.edited(made, "blocks.0.width_m", "44", "cm")
    assert own["blocks"][0]["width_m"] == 0.44
    assert own["blocks"][0]["height_m"] == catalogue[name].height
    assert "catalogue" not in own["blocks"][0]


def test_restraints_stay_below_the_upper_edge(start):
    made = state.edited(start, "blocks.0.height_m", "150", "cm")
    assert made["restraints"]["strap"]["height_m"] == pytest.approx(1.4)


def test_laws_that_apply(start):
    content = state.edited(start, "blocks.0.restraint", "strap", "cm")
    models = piece_studies.contents_of(content)["piece"]["models"]
    assert models == [{"law": "housner", "geometry": "linear"}]
    assert {model["law"] for model in piece_studies.contents_of(start)["piece"]["models"]} <= {*LAWS}


def test_less_restitution_is_a_study_of_the_reference_law(start):
    """The range of the restitution has studies of its own; none if the study gives e, or the law has no restitution."""
    for name, of in (("restitution", "piece"), ("earthquake-restitution", "earthquake")):
        contents = piece_studies.contents_of(state.edited(start, "feet", "vinyl", "cm"))
        assert contents[name]["models"] == [{"law": "housner", "restitution_factor": 0.7}]
        assert contents[name]["ida"] == contents[of]["ida"]
        assert "friction" in contents[of]
        assert "friction" not in contents[name]
    assert "restitution" not in piece_studies.contents_of(state.edited(start, "models.e", "0.9", "cm"))
    assert "restitution" not in piece_studies.contents_of(
        {**start, "models": [{"law": "vassiliou", "coefficient": 0.1}]}
    )


@pytest.mark.parametrize("edits", [[], [("wall", "yes"), ("blocks.0.restraint", "two brackets")], [("building", "no")]])
def test_files_hold_valid_studies_and_the_state(start, tmp_path, edits):
    content = start
    for path, text in edits:
        content = state.edited(content, path, text, "cm")
    contents = piece_studies.contents_of(content)
    files = state.write_state(tmp_path / "piece.live.toml", contents)
    assert [file.name for file in files] == [
        "piece.live.toml",
        "piece.live.earthquake.toml",
        "piece.live.restitution.toml",
        "piece.live.earthquake-restitution.toml",
        "piece.live.remedies.toml",
    ]
    for file in files:
        read_study_file(file)
    again = state.read_state(files[0])
    assert {**again, "models": 0} == {**content, "models": 0}


@pytest.mark.parametrize("text", ["plain", "a\"b\\c'''d", "ü 😀 \x7f\t\n", "<script>alert(1)</script>", "]] = [[", ""])
def test_toml_holds_every_text(start, text):
    content = {**start, "title": text, "restraints": {text: {"kind": "strap", "flags": [True, 1, 2.5, [text]]}}}
    assert tomllib.loads(state.toml_of(content)) == content


def test_bounds_and_sentences_are_declared(start):
    schema = study_schema()
    about = schema["$defs"]["SiteBasedScenarioScenarioMotions"]["properties"]["magnitude"]
    shown = state.field(start, "motions.magnitude", "cm")
    assert (shown.least, shown.most, shown.about) == (about["minimum"], about["maximum"], about["description"])
    assert state.field(start, "motions.distance_m", "cm").unit == "km"


def test_other_studies_are_refused(tmp_path, start):
    file = tmp_path / "two.toml"
    two = {**start, "blocks": start["blocks"] * 2}
    file.write_text(state.toml_of(two), encoding="utf-8")
    with pytest.raises(StudyError, match=r"one \[\[blocks\]\]"):
        state.read_state(file)


def test_options_of_all_laws(start):
    made = state.edited(start, "models.delta", "0.1", "cm")
    assert {model["law"]: model.get("delta") for model in made["models"]} == {
        "housner": None,
        "energy-consistent": 0.1,
        "discrete": 0.1,
        "giannini-masiani": 0.1,
    }
    made = state.edited(made, "law.makris-konstantinidis", "yes", "cm")
    assert made["models"][-1] == {"law": "makris-konstantinidis", "delta": 0.1}
    assert len(state.edited(made, "law.housner", "no", "cm")["models"]) == 4
    assert state.edited(made, "models.delta", "", "cm")["models"][:4] == start["models"]
    alone = {**start, "models": [{"law": "housner"}]}
    with pytest.raises(StudyError, match="one law"):
        state.edited(alone, "law.housner", "no", "cm")
    with pytest.raises(StudyError):
        state.edited(start, "law.nothing", "yes", "cm")
