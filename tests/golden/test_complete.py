"""Every key of study files, every option of the command and every public name occurs in the corpus, but for a list."""

import ast
import csv
import inspect
import re
import tomllib
from operator import attrgetter
from pathlib import Path

import command_cases
import pytest
import refused_cases
import script_cases
import study_cases
from case import HERE

import toppling
from toppling.fragility.curves import published
from toppling.models import friction
from toppling.studies.command.cli import COMMANDS, app
from toppling.studies.file.json_schema import study_schema

NOT_COVERED = HERE / "not_covered.csv"
SCHEMA = study_schema()
FACES = {
    "toppling": toppling,
    **{
        f"toppling.{name}": attrgetter(name)(toppling) for name in ("models", "motions", "fragility", "studies", "plot")
    },
    "toppling.models.friction": friction,
    "toppling.fragility.curves.published": published,
}


def all_cases():
    # (the array of pairs has no key that the studies lack, and is long)
    modules = (study_cases, refused_cases, command_cases, script_cases)
    return [case for module in modules for case in module.cases()]


KINDS = {
    "MotionsTable": r".*Motions",
    "ModelTable": r".+ModelTable",
    "EnvelopeTable": r".+EnvelopeTable",
    "RestraintTable": r".+RestraintTable",
    "IsolationTable": r".+IsolationTable",
    "SupportTable": r".+SupportTable",
    "BuildingTable": r"GroundTable|.*FloorsTable|.*StoreysTable",
    "CodeTable": r".+CodeTable",
    "HazardTable": r"HazardFileTable|PowerLawTable|LogQuadraticTable|HazardPointsTable",
    "InputTable": r"(Normal|Lognormal|Uniform|Beta|Least|Choice)Table",
}
"""Names of tables among which a word chooses."""


def kind_of(table):
    return next((kind for kind, names in KINDS.items() if re.fullmatch(names, table)), table)


def keys_of_schema():
    tables = {"": SCHEMA, **SCHEMA["$defs"]}
    return {
        f"{kind_of(table)}.{key}".lstrip(".") for table, about in tables.items() for key in about.get("properties", {})
    }


def chosen(value, about):
    """Whether a value is of a table of the schema, by the word or the key that chooses it."""
    table = SCHEMA["$defs"][about["$ref"].rpartition("/")[2]]
    words = {key: part["const"] for key, part in table["properties"].items() if "const" in part}
    own = {key: word for key, word in words.items() if key in table.get("required", ())}
    return all(value.get(key) == word for key, word in own.items()) and {*table.get("required", ())} <= {*value}


def keys_in(value, about, table):
    """Yield the keys of a value that its part of the schema knows, with the names of their tables."""
    if "$ref" in about:
        table = about["$ref"].rpartition("/")[2]
        about = SCHEMA["$defs"][table]
    for other in about.get("anyOf", ()):
        yield from keys_in(value, other, table)
    if isinstance(value, dict):
        for other in about.get("oneOf", ()):
            if "$ref" in other and chosen(value, other):
                yield from keys_in(value, other, table)
    if isinstance(value, list):
        for item in value:
            yield from keys_in(item, about.get("items", {}), table)
    if not isinstance(value, dict):
        return
    properties, further = about.get("properties", {}), about.get("additionalProperties")
    for key, inner in value.items():
        if key in properties:
            yield f"{kind_of(table)}.{key}".lstrip(".")
            yield from keys_in(inner, properties[key], table)
        elif isinstance(further, dict):
            yield from keys_in(inner, further, table)


def keys_of(cases):
    """Return the keys in the studies of cases that refuse nothing."""
    files = {
        content for case in cases if not case.names for name, content in case.files.items() if name.endswith(".toml")
    }
    texts = (file.read_text(encoding="utf-8") if isinstance(file, Path) else file for file in files)
    studies = [tomllib.loads(text) for text in texts]
    # (keys of [motions] that differ from level to level belong to those that they are merged with)
    of_levels = [
        {**study.get("motions", {}), **stripe.get("motions", {})}
        for study in studies
        for stripe in study.get("stripes", {}).get("at", ())
    ]
    found = {key for study in studies for key in keys_in(study, SCHEMA, "")}
    return found | {key for table in of_levels for key in keys_in(table, SCHEMA["properties"]["motions"], "")}


def options_of_command():
    return {
        f"{command} {name}"
        for command in COMMANDS
        for argument in app[command].assemble_argument_collection()
        for name in argument.names
        if name.startswith("--")
        and argument.parameter.show is not False
        and argument.field_info.kind.name != "POSITIONAL_OR_KEYWORD"
    }


def options_in(cases):
    lines = [command[1:] if command[0].startswith("SIG") else command for case in cases for command in case.commands]
    return {f"{line[0]} {word.partition('=')[0]}" for line in lines for word in line if word.startswith("--")}


def public_names():
    """Yield public names of all faces, and the methods of their classes as `.name`."""
    for face, module in FACES.items():
        names = getattr(module, "__all__", None) or [
            name for name, member in vars(module).items() if getattr(member, "__module__", "") == module.__name__
        ]
        for name in names:
            if name[0] == "_":
                continue
            yield f"{face}.{name}"
            member = getattr(module, name)
            for part in dir(member) if inspect.isclass(member) else ():
                method = inspect.getattr_static(member, part)
                own = getattr(getattr(method, "__func__", method), "__module__", "") or ""
                if part[0] != "_" and own.startswith("toppling") and callable(getattr(member, part)):
                    yield f".{part}"


def names_in_scripts():
    """Yield the dotted names that scripts use, and every attribute as `.name`."""
    for name in script_cases.NAMES:
        tree = ast.parse((script_cases.SCRIPTS / f"{name}.py").read_text(encoding="utf-8"))
        heads = {}
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                heads |= {alias.asname or alias.name: alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                heads |= {alias.asname or alias.name: f"{node.module}.{alias.name}" for alias in node.names}
        yield from heads.values()
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute):
                yield f".{node.attr}"
                head, _, rest = ast.unparse(node).partition(".")
                yield f"{heads.get(head, head)}.{rest}"


@pytest.fixture(scope="module")
def kinds():
    """What there is and what occurs, of each kind."""
    cases = all_cases()
    return {
        "key": (keys_of_schema(), keys_of(cases)),
        "option": (options_of_command(), options_in(cases)),
        "name": (set(public_names()), set(names_in_scripts())),
    }


@pytest.mark.parametrize("kind", ["key", "option", "name"])
def test_everything_occurs(kinds, kind):
    """What does not occur is listed with a reason, and nothing else is."""
    with NOT_COVERED.open(encoding="utf-8", newline="") as file:
        listed = {row["name"]: row["reason"] for row in csv.DictReader(file) if row["kind"] == kind}
    there, occurs = kinds[kind]
    assert sorted(there - occurs) == sorted(listed)
    assert all(listed.values())


def test_all_keys_are_counted():
    assert len(keys_of_schema()) == 367


def test_names_of_cases_differ():
    names = [case.name for case in all_cases()]
    assert len(names) == len(set(names))
