"""The schema of study files: one source for what is read, what editors are told, and the reference of keys."""

import inspect
import json
import math
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import jsonschema
import pytest
from study_schema import made_keys

import toppling as tp
from toppling import motions as mo
from toppling.core.parameters import Parameter, check, declared
from toppling.models import LAWS
from toppling.studies.command.cli import main
from toppling.studies.file import json_schema
from toppling.studies.file.derived import Derived, derived
from toppling.studies.file.schema import StudyFile
from toppling.studies.file.table import Table, bare

EXAMPLES = sorted((Path(tp.__file__).parent / "studies" / "examples").glob("*.toml"))
SCHEMA = json_schema.study_schema()
CHECK = jsonschema.Draft202012Validator(SCHEMA)
TABLES = {table.__name__: table for table in json_schema.all_tables()}


def keys():
    """Every key of every table: (table, key, its field, what the schema says of it)."""
    for name, table in TABLES.items():
        own = SCHEMA if table is StudyFile else SCHEMA["$defs"][name]
        for attribute, field in table.model_fields.items():
            key = field.alias or attribute
            yield name, key, field, own["properties"][key]


def broken(content):
    return [f"{error.json_path}: {error.message}" for error in CHECK.iter_errors(content)]


class TestSchema:
    def test_is_valid_and_names_its_draft(self):
        jsonschema.Draft202012Validator.check_schema(SCHEMA)
        assert SCHEMA["$schema"] == "https://json-schema.org/draft/2020-12/schema"

    @pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
    def test_examples_are_valid(self, path):
        assert broken(tomllib.loads(path.read_text())) == []

    def test_every_table_is_there(self):
        assert set(SCHEMA["$defs"]) == set(TABLES) - {"StudyFile"}
        assert len(TABLES) > 15

    def test_every_key_is_described(self):
        for name, key, _, said in keys():
            text = said.get("description", "")
            assert text, f"{name}.{key}"
            assert len(text.split()) >= 2, f"{name}.{key}"
            assert text.rstrip(".") != text, f"{name}.{key}: {text}"
        for name, table in TABLES.items():
            assert SCHEMA["$defs"].get(name, SCHEMA)["description"] == table.__doc__.partition("\n\n")[0]

    def test_every_number_has_a_unit(self):
        for name, key, field, said in keys():
            if '"number"' in json.dumps(said) and "properties" not in said:
                assert said["unit"], f"{name}.{key}"
            if bare(key) != key:
                assert said["unit"] == json_schema.unit_of(key, field) != "", f"{name}.{key}"

    def test_nothing_is_null(self):
        """TOML has no null: a key that may be left out is one that is not required."""
        assert "null" not in json.dumps(SCHEMA)

    def test_only_what_must_be_given_has_no_default_or_may_be_absent(self):
        for name, key, field, said in keys():
            if field.is_required():
                assert "default" not in said, f"{name}.{key}"
                assert "Where not given" not in said["description"], f"{name}.{key}"

    def test_words_are_enums(self):
        laws = [one["$ref"].rpartition("/")[2] for one in SCHEMA["properties"]["models"]["items"]["oneOf"]]
        assert [SCHEMA["$defs"][name]["properties"]["law"]["const"] for name in laws] == list(LAWS)
        motions = [one["$ref"].rpartition("/")[2] for one in SCHEMA["properties"]["motions"]["oneOf"]]
        words = [SCHEMA["$defs"][name]["properties"].get("generator", {}).get("const") for name in motions]
        assert [word for word in words if word] == list(mo.GENERATORS)

    def test_defaults_are_those_of_what_is_built(self):
        found = 0
        for name, key, _, said in keys():
            table = TABLES[name]
            if not issubclass(table, Derived) or key not in getattr(table, "si_factors", {}):
                continue
            parameter, factor = table.si_factors[key]
            default = declared(table.makes)[parameter].default
            default = list(default) if isinstance(default, tuple) else default
            is_plain = default != math.inf and isinstance(default, int | float | str | list)
            if is_plain and key not in table.__base__.model_fields:
                assert said["default"] == (default if factor == 1.0 else pytest.approx(default / factor, rel=1e-12)), (
                    key
                )
                found += 1
        assert found >= 100

    def test_every_key_is_used(self):
        """A key of a derived table is a parameter of what it makes, or is one that its base uses."""
        used = {
            *("kind", "standard", "cost", "target", "law", "settlement_mm", "rocking_frequency_hz"),
            *("generator", "number", "seed", "component", "axes", "azimuth", "correlation", "match_gmm", "pulse"),
            *("name", "floors", "system", "sds_g", "sd1_g", "importance", "isolation", "base_mass_kg"),
            *("body_frequency_hz", "yield_coefficient", "hardening", "p_delta", "strength_dispersion"),
        }
        for name, table in TABLES.items():
            if hasattr(table, "si_factors"):
                assert set(table.model_fields) - set(table.si_factors) <= used, name

    def test_defaults_of_functions(self):
        functions = {"order": mo.bandpass, "azimuth": mo.both_axes, "correlation": mo.Generator.sample_pairs}
        found = [(key, said["default"]) for _, key, _, said in keys() if key in functions and "default" in said]
        assert {key for key, _ in found} == set(functions)
        for key, default in found:
            assert default == inspect.signature(functions[key]).parameters[key].default

    def test_an_included_part_needs_no_more_than_it_says(self):
        assert broken({"include": ["common.toml"], "ida": {"levels": {"values": [1.0], "unit": "g"}}}) == []
        assert any("'title' " in message for message in broken({}))

    @pytest.mark.parametrize("im", ["pga", "PGA", "Pgv", "sa(1.0)", "AVGSA(0.2:2.0:10)", "Scale"])
    def test_measures_in_any_capitals(self, im):
        assert broken({"include": ["x"], "ida": {"im": im, "levels": {"values": [1.0], "unit": "g"}}}) == []

    @pytest.mark.parametrize(
        ("where", "content"),
        [
            ("$.blocks", {"blocks": {}}),
            ("$.blocks[0].width_m", {"blocks": [{"width_m": -1.0, "height_m": 1.0}]}),
            ("$.models[0]", {"models": [{"law": "discreet"}]}),
            ("$.ida.im", {"ida": {"im": "PGB", "levels": {"values": [1.0], "unit": "g"}}}),
            ("$.ida.levels", {"ida": {"levels": [1, 2]}}),
            ("$.motions", {"motions": {"generator": "site-based", "number": "many"}}),
            ("$.motions", {"motions": {"generator": "kanai-tajimi", "number": 3, "magnitude": 6.0}}),
            ("$.stripes.at[0].motions", {"stripes": {"unit": "g", "at": [{"level": 1.0, "motions": {"nmber": 3}}]}}),
            ("$.friction.static", {"friction": {"static": 40}}),
        ],
    )
    def test_refuses_what_is_refused(self, where, content):
        assert any(one.startswith(f"{where}:") for one in broken({"include": ["x"], **content}))


class TestCommand:
    def test_prints_the_schema_or_writes_it(self, tmp_path, capsys):
        assert main(["schema"]) == 0
        assert json.loads(capsys.readouterr().out) == SCHEMA
        assert main(["schema", "--out", str(tmp_path / "study.json")]) == 0
        assert capsys.readouterr().out == ""
        assert json.loads((tmp_path / "study.json").read_text(encoding="utf-8")) == SCHEMA


def test_bounds_of_a_text_are_numbers_of_its_characters():
    @dataclass(frozen=True)
    class Sign:
        """A sign.

        Parameters
        ----------
        words : str
            Its words.
        """

        words: Annotated[str, Parameter(at_least=1, at_most=5)] = "shelf"

        def __post_init__(self):
            check(self)

    table = derived(Sign)
    for words in ("a", "shelf", "größe"):
        assert table(words=words).build() == Sign(words)
    for words in ("", "shelf1"):
        with pytest.raises(ValueError, match="words must be of >= 1 and <= 5 characters, got"):
            Sign(words)
        with pytest.raises(ValueError, match="words"):
            table(words=words)
    about = table.model_json_schema()["properties"]["words"]["anyOf"][0]
    assert about == {"type": "string", "minLength": 1, "maxLength": 5}


class TestReference:
    def test_names_every_key_with_its_unit(self):
        page = made_keys.key_reference()
        for name, key, _, said in keys():
            assert f"| `{key}` |" in page, f"{name}.{key}"
            assert f"| {said.get('unit', '')} |" in page
        for heading in ("[[blocks]]", "[motions.envelope]", "[[stripes.at]]", "[uncertainty.inputs.NAME]"):
            assert f"### `{heading}`" in page

    def test_rows(self):
        lines = [line for line in made_keys.key_reference().splitlines() if line.startswith("|")]
        assert {line.replace("\\|", "").count("|") for line in lines} == {6, 7}
        rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in lines]
        static = ["`static`", "Static coefficient of friction, or its median.", "1", "that of contact"]
        alpha0 = ["`alpha0`", declared(mo.Building.flexural_shear)["alpha0"].sentence, "1", "`5`"]
        assert [*static, "number ≥ 0.05, ≤ 2"] in rows
        assert [*alpha0, "number ≥ 0, ≤ 10000", "`flexural-shear`"] in rows


def test_bounds_of_a_value_that_may_be_none_are_inside():
    """A bound beside None would be of no effect."""

    class Good(Table):
        step_s: Annotated[float, Parameter("s", above=0.0)] | None = None

    assert Good(step_s=0.1).step_s == 0.1
    with pytest.raises(ValueError, match="greater than 0"):
        Good(step_s=0.0)

    class Wrong(Table):
        step_s: Annotated[float | None, Parameter("s", above=0.0)] = None

    with pytest.raises(TypeError, match="bounds must be of a number or a text"):
        Wrong(step_s=0.1)
