"""Tables of published tests: what a row needs, errors of one sentence, and the project's own table."""

import re
from pathlib import Path

import pytest
from experiment_tables import ROW, table_of
from table_rows import table_rows

from toppling.benchmarks.experiments.table import NO, ExperimentError, read_experiments

ROOT = Path(__file__).resolve().parents[3]
OWN = ROOT / "docs" / "experiments.csv"


class TestReading:
    def test_a_row_in_three_parts(self, tmp_path):
        (row,) = read_experiments(table_of(tmp_path / "t.csv", {**ROW, "width_m": "0.4|0.5", "height_m": "1.8|1.2"}))
        assert (row.test.width, row.test.height, row.test.levels) == ((0.4, 0.5), (1.8, 1.2), (6.0, 6.5))
        assert (row.outcome.overturned, row.test.trials) == (3, 4)
        assert row.source.quality == "B"
        assert row.test.predicted

    @pytest.mark.parametrize("row", table_rows(Path(__file__).with_name("errors.csv")))
    def test_errors_name_file_line_and_column(self, tmp_path, row):
        changes = dict(change.split("=") for change in row["changes"].split(" ; "))
        path = table_of(tmp_path / "t.csv", {**ROW, **changes})
        with pytest.raises(ExperimentError, match=row["said"]) as caught:
            read_experiments(path)
        assert str(caught.value).startswith(f"{path}, line 2,")
        assert f" {row['column']!r}: " in str(caught.value)
        assert "\n" not in str(caught.value)

    def test_ids_used_twice_and_empty_tables(self, tmp_path):
        with pytest.raises(ExperimentError, match="line 3, column 'id': is used twice"):
            read_experiments(table_of(tmp_path / "t.csv", ROW, ROW))
        with pytest.raises(ExperimentError, match="has no rows"):
            read_experiments(table_of(tmp_path / "t.csv"))
        with pytest.raises(ExperimentError, match="no such file"):
            read_experiments(tmp_path / "missing.csv")


class TestOwnTable:
    def test_its_size(self):
        """At least 60 rows of at least 15 sources."""
        rows = read_experiments(OWN)
        assert len(rows) >= 60
        assert len({row.source.source for row in rows}) >= 15

    def test_every_row_leads_to_its_source_and_says_what_was_read(self):
        for row in read_experiments(OWN):
            address = row.source.address
            assert re.fullmatch(r"https?://\S+", address) if address else row.source.place, row.test.id
            assert row.source.read, row.test.id
            assert row.source.read != "recalled" or row.source.quality == "D", row.test.id

    def test_rows_have_an_outcome_or_say_that_there_is_none(self):
        for row in read_experiments(OWN):
            found = row.outcome
            known = found.overturned is not None or found.value is not None or bool(found.text)
            assert known or row.test.predict.startswith(NO), row.test.id
