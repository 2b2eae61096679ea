"""Reports of results with hostile names, results that are refused, and the command."""

import re
from io import StringIO

import pytest
import xarray as xr
from markdown_it import MarkdownIt
from report_pages import HOSTILE, OVERFLOW, WIDTHS, Page, accessible, loaded, outside, write_hostile, written
from rich.console import Console

from toppling.studies.command.cli import main
from toppling.studies.report import page as module
from toppling.studies.report.page import markdown, write_report
from toppling.studies.tables.table import Column, Table
from toppling.studies.tables.terminal import rendered
from toppling.studies.text.names import clean, drawable


class TestHostile:
    def test_nothing_is_markup(self, hostile):
        outside(hostile)
        accessible(Page(hostile))
        text = hostile.read_text(encoding="utf-8")
        assert "<script" not in text
        assert "<img" not in text
        assert "{{ 7*7 }} {% raw %}" in text  # printed as it is, not evaluated
        assert "49 {%" not in text
        assert not re.search("[\x00-\x08\x0b-\x1f\u202a-\u202e]", text)

    @pytest.mark.slow
    def test_forty_blocks_under_six_laws(self, chromium, folder):
        path = write_hostile(folder, 40)
        outside(path)
        assert path.stat().st_size < 3.5e6  # (every figure is there twice, for a page and for a phone)
        for width in WIDTHS:
            assert chromium.see(path, width, OVERFLOW).value == [width, width, "complete"]

    def test_names_are_whole_in_tables(self, hostile):
        text = "".join(Page(hostile).text)
        assert HOSTILE[0] in text
        assert HOSTILE[2] in text
        assert "<i>none</i>" in text

    def test_figures_get_short_names_all_different(self):
        long = [f"{'x' * 300}{i}" for i in range(3)]
        found = drawable(xr.Dataset(coords={"block": long, "model": ["a$b", "a", "b\x01"]}))
        assert len(set(found["block"].values)) == 3
        assert max(map(len, found["block"].values)) < 70
        assert found["model"].values.tolist() == [r"a\$b", "a", "b\ufffd"]

    @pytest.mark.slow
    def test_markdown_is_text(self, folder, hostile, tmp_path):
        write_report(folder / "hostile3.nc", tmp_path / "hostile.md", "md")
        text = (tmp_path / "hostile.md").read_text(encoding="utf-8")
        above = text.partition("The study file:")[0]
        assert "<" not in above
        rows = [line for line in above.splitlines() if line.startswith("|")]
        assert rows
        assert all(line.endswith("|") for line in rows)

    def test_titles_and_headings_are_text(self):
        name = "a|b *c* <d> [red]e[/] \\[f]"
        table = Table(f"Of {name}", (Column("a"), Column("b", name)), [{"a": name, "b": "1"}])
        console = Console(width=200, file=StringIO())
        console.print(*rendered(table, 200))
        assert console.file.getvalue().count(name) == 3

    @pytest.mark.slow
    def test_markdown_is_read_as_it_was_meant(self, folder, tmp_path):
        name = "a|b *c* <d> [red]e[/] _f_ `g`"
        results = loaded(folder, "sensitivity").assign_coords(block=[name])
        write_report(written(results, tmp_path), tmp_path / "named.md", "md")
        text = (tmp_path / "named.md").read_text(encoding="utf-8")
        tokens = MarkdownIt().enable("table").parse(text.partition("The study file:")[0])
        assert not [one for one in tokens if one.type in ("html_block", "html_inline")]
        inline = [one for one in tokens if one.type == "inline"]
        plain = ["".join(part.content for part in one.children) for one in inline]
        assert sum(name in one for one in plain) > 3
        said = module.content(results, tmp_path / "changed.nc", "as written")
        every = [*said["lead"], *said["tables"], *said["input_tables"], *said["provenance"]]
        assert sum(one.type == "table_open" for one in tokens) == len(every)

    def test_clean(self):
        assert clean("a\nb\ud800") == "a\nb\ufffd"
        assert markdown("# [a](b)\n*c*") == r"\# \[a\](b) \*c\*"
        assert markdown("about 18 (10 to 29) + 1, of #2!") == "about 18 (10 to 29) + 1, of #2!"
        (heading,) = [one for one in MarkdownIt().parse(f"# {markdown('Office #')}") if one.type == "inline"]
        assert "".join(one.content for one in heading.children) == "Office #"
        for text in ("# a", "+ a", "- a", "1. a", "12) a", "===", "---", "-", "+", "##", "![a](b)", "[a]: b"):
            tokens = MarkdownIt().parse(markdown(text))
            assert [one.type for one in tokens] == ["paragraph_open", "inline", "paragraph_close"], text
            assert "".join(one.content for one in tokens[1].children) == text

    @pytest.mark.slow
    def test_one_block_one_law(self, folder, tmp_path):
        one = loaded(folder).isel(block=[0], model=[0])
        assert write_report(written(one, tmp_path), tmp_path / "one.html")
        assert "“shelf” overturns with a chance of" in (tmp_path / "one.html").read_text(encoding="utf-8")


class TestRefused:
    def said(self, capsys, *arguments):
        assert main(["report", *map(str, arguments)]) == 2
        caught = capsys.readouterr()
        assert caught.out == ""
        assert caught.err.count("\n") == 1
        assert "Traceback" not in caught.err
        return caught.err

    def test_files_that_are_not_ours(self, capsys, folder, tmp_path):
        assert "no such file" in self.said(capsys, tmp_path / "none.nc")
        assert "results.nc: no such file" in self.said(capsys, tmp_path)
        (tmp_path / "text.nc").write_text("not netCDF", encoding="utf-8")
        assert "is no result file" in self.said(capsys, tmp_path / "text.nc")
        whole = (folder / "cloud" / "results.nc").read_bytes()
        for i, size in enumerate((0, 100, len(whole) // 2, len(whole) - 100)):
            (tmp_path / f"cut{i}.nc").write_bytes(whole[:size])
            self.said(capsys, tmp_path / f"cut{i}.nc")
        foreign = xr.Dataset({"t": ("x", [1.0, 2.0])})
        assert "not one of toppling's" in self.said(capsys, written(foreign, tmp_path))

    @pytest.mark.slow
    @pytest.mark.filterwarnings("ignore:.* was edited after it was written")
    def test_layouts(self, capsys, folder, tmp_path):
        results = loaded(folder, "cloud")
        for layout, word in ((99, "newer"), (0, "older"), ("x", "must be a number")):
            assert word in self.said(capsys, written(results.assign_attrs(schema=layout), tmp_path))
        assert "kind 'ghost'" in self.said(capsys, written(results.assign_attrs(kind="ghost"), tmp_path))
        runs = results.drop_attrs().assign_attrs({k: v for k, v in results.attrs.items() if k != "kind"})
        assert "holds runs" in self.said(capsys, written(runs, tmp_path))
        assert "does not hold what" in self.said(capsys, written(results.drop_vars("median"), tmp_path))
        wrong = results.assign_attrs(kind="sensitivity")
        assert "does not hold what" in self.said(capsys, written(wrong, tmp_path))

    @pytest.mark.slow
    def test_where_it_cannot_be_written(self, capsys, folder, tmp_path):
        path = folder / "cloud" / "results.nc"
        (tmp_path / "file").write_text("", encoding="utf-8")
        assert "cannot be written" in self.said(capsys, path, "--out", tmp_path / "file" / "report.html")
        assert "results themselves" in self.said(capsys, path, "--out", path)
        assert "must be a folder or end in .html or .md" in self.said(capsys, path, "--out", tmp_path / "report.pdf")
        assert "--format" in self.said(capsys, path, "--format", "pdf")


@pytest.mark.slow
def test_command(folder, tmp_path, capsys):
    assert main(["report", str(folder / "stripes" / "results.nc"), "--out", str(tmp_path / "a" / "b.html")]) == 0
    assert (tmp_path / "a" / "b.html").stat().st_size > 10_000
    assert "written:" in capsys.readouterr().out
    assert main(["report", str(folder / "stripes" / "results.nc"), "--format", "md", "--out", str(tmp_path / "m")]) == 0
    assert main(["report", str(folder / "stripes" / "results.nc"), "--out", str(tmp_path / "a" / "c.md")]) == 0
    assert (tmp_path / "a" / "c.md").read_text(encoding="utf-8").startswith("# ")  # (the file's ending says the format)
    text = (tmp_path / "m" / "report.md").read_text(encoding="utf-8")
    for name in re.findall(r"\]\(([^)]+)\)", text):
        assert (tmp_path / "m" / name).read_bytes().startswith(b"\x89PNG")
    assert "![" in text
