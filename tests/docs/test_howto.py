"""Numbers and output that how-to pages show, from the studies that give them."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from toppling.studies.command.cli import main as command

pytestmark = [pytest.mark.repository, pytest.mark.slow]

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "studies/examples"


def text_of(page):
    return (ROOT / f"docs/howto/{page}.md").read_text(encoding="utf-8")


def shown(page, shell):
    """Return the lines of output that a page shows after a command."""
    output = text_of(page).partition(f"```sh\n{shell}\n```\n\n```text\n")[2].partition("```")[0]
    assert output, f"{page} shows no output of {shell}"
    return [line for line in output.splitlines() if line != "..."]


@pytest.fixture
def run(tmp_path, monkeypatch, capsys):
    """A function that runs a study and returns its results and what it prints; options follow its name."""
    monkeypatch.setenv("COLUMNS", "90")

    def run(study, *options):
        assert command(["run", str(study), *options, "--out", str(tmp_path / "results")]) == 0
        printed = "".join(capsys.readouterr())
        with xr.open_dataset(tmp_path / "results/results.nc") as results:
            return results.load(), printed

    return run


def example(run, name, page=""):
    """Run an example; its output has every line that the page shows."""
    results, printed = run(EXAMPLES / f"{name}.toml")
    if page:
        assert set(shown(page, f"toppling run studies/examples/{name}.toml")) <= set(printed.splitlines())
    return results, printed


def test_medians_of_laws(run):
    results, _ = example(run, "office", "choose_a_law")
    laws = results["law"].values.astype(str)
    ratios = results["half_level"] / results["half_level"].isel(model=int(np.argmax(laws == "housner")))
    table = dict(re.findall(r"(?m)^\| `([\w-]+)` \|.*\| (\d[\d.–]*) \|$", text_of("choose_a_law")))
    assert set(table) == set(laws)
    ends = {}
    for law, ratio in zip(laws, ratios.transpose("model", "block").values, strict=True):
        ends[law] = (float(ratio.min()), float(ratio.max()))
        if law != "housner":
            assert [float(end) for end in table[law].split("–")] == pytest.approx(ends[law], abs=0.0051), law
    whole = min(low for low, _ in ends.values()), max(high for _, high in ends.values())
    assert "their medians are {:.2f} to {:.2f} times".format(*whole) in text_of("choose_a_law")


def test_spread_over_branches(run):
    results, _ = example(run, "branches", "uncertainty")
    fractiles = results["epistemic_rate_fractile"].isel(block=0)
    text = text_of("uncertainty")
    assert f"by a factor of {float(fractiles[-1] / fractiles[0]):.0f}" in text
    shares = results["epistemic_spread"].isel(block=0).to_series() * 100.0
    assert (
        f"Modelling causes {shares['modelling']:.0f} % of this spread and the hazard curve {shares['hazard']:.0f} %"
        in text
    )
    assert shares[["models", "motions"]].max() < 1.0


def test_shares_of_uncertain_inputs(run):
    results, _ = example(run, "uncertainty", "uncertainty")
    alone = 100.0 * results["capacity_share"].isel(block=0).to_series()
    total = 100.0 * float(results["capacity_total_share"].isel(block=0)[-1])
    words = f"cause {alone['sample']:.0f} % of the variance of ln(capacity), or {total:.0f} % with their interactions"
    assert f"{words}. The law causes {alone['model']:.0f} %" in text_of("uncertainty")


def test_precision_of_adaptive_studies(run):
    results, _ = example(run, "adaptive")
    motions, reached = results["motions_run"], 100.0 * results["half_width"]
    assert (
        f"needs {int(motions.min())} to {int(motions.max())} motions for its four curves and reaches "
        f"±{float(reached.min()):.1f} to ±{float(reached.max()):.1f} %" in text_of("precision")
    )


def test_precision_of_a_region(run):
    results, _ = example(run, "region")
    words = f"{results.sizes['pooled_run']:,} runs under {int(results['motions_run'].max())} motions"
    assert words in text_of("precision")
    assert "±6.4\u00a0% at most" in str(results["account"].values[0])


def test_the_yielding_building_without_its_strength(run, tmp_path):
    whole = (EXAMPLES / "yielding.toml").read_text("utf-8")
    (tmp_path / "elastic.toml").write_text(re.sub(r"(?m)^(yield_coeff|strength_disp).*\n", "", whole), encoding="utf-8")
    elastic, _ = run(tmp_path / "elastic.toml")
    bookcase, cabinet = elastic["half_level"].isel(model=0, floor=-1).values / 9.80665
    words = f"cabinets on the roof overturn at {cabinet:.2f} g and half of the bookcases at {bookcase:.2f} g"
    assert words in text_of("buildings")


def test_kits_for_a_target(run):
    _, printed = example(run, "kits")
    assert re.search(
        r"To keep falls into the room .* for 480 EUR\. .* into the room one in 140 years \(now one in 20 ", printed
    )


def test_a_smaller_budget(run, tmp_path):
    whole = (EXAMPLES / "clinic.toml").read_text("utf-8")
    (tmp_path / "clinic.toml").write_text(whole.replace("budget = 1000", "budget = 200"), encoding="utf-8")
    (tmp_path / "inventory.csv").write_bytes((EXAMPLES / "inventory.csv").read_bytes())
    _, printed = run(tmp_path / "clinic.toml")
    block = text_of("budget").partition("instead of its 1,000 EUR gives:\n\n```text\n")[2].partition("```")[0]
    assert {line for line in block.splitlines() if line != "..."} <= set(printed.splitlines())


def test_the_strength_of_a_restraint(run, tmp_path, capsys):
    assert command(["new", "bookcase", str(tmp_path / "shelf")]) == 0
    capsys.readouterr()
    _, printed = run(tmp_path / "shelf/study.toml", "--target", "0.001")
    assert set(shown("budget", "toppling run shelf/study.toml --target 0.001")) <= set(printed.splitlines())
