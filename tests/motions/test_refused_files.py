"""Floors, spectra, targets and disaggregations of wrong files: one sentence that names the file."""

from pathlib import Path

import pytest
from table_rows import table_rows

from toppling import motions as mo
from toppling.motions import RecordError
from toppling.motions.selection.files import TargetError

LEVELS = ((0.02, 0.4), (0.1, 0.2))
PERIODS = ((0.0, 0.9, 0.5), (0.5, 1.4, 0.42), (1.0, 1.0, 0.027), (2.0, 0.4, 0.46))
PARTS = {
    "<spectra>": '#,,,,"generated_by=OpenQuake engine, site_id=0, lon=-122.0, lat=37.0"\n'
    "poe,stat,period,mea,std\n"
    + "".join(
        f"{poe},mean,{period},{level * ratio},{std}\n" for poe, level in LEVELS for period, ratio, std in PERIODS
    ),
    "<table>": "measure,unit,median,sigma\nSa(0.5),g,0.2774773026,0.639513096\nSa(1.0),g,0.1450798388,0.6924081166\n"
    "PGV,cm/s,14.86829403,0.651475249\nd5_95,s,12.22547952,0.4301162634\n",
    "<engine>": '#,,,,,"generated_by=OpenQuake, investigation_time=50.0, mag_bin_edges=[6, 7, 8]"\n',
    "<bins>": "SA(1.0),0.4,0.02,6.5,10.0,0.008\nSA(1.0),0.4,0.02,7.5,30.0,0.012\nSA(1.0),0.4,0.02,5.5,30.0,0.0",
    "<two>": "0,1\n1,1\n",
}
"""What stands in place of words in brackets in the texts of refused.csv."""
READERS = {
    "floors": (lambda path, row: mo.read_floors(path), RecordError),
    "spectrum": (lambda path, row: mo.TargetSpectrum.from_csv(path), RecordError),
    "target": (lambda path, row: mo.read_target(path, row["given"], statistic=row["statistic"]), TargetError),
    "disaggregation": (lambda path, row: mo.read_disaggregation(path), TargetError),
}


@pytest.mark.parametrize("row", table_rows(Path(__file__).with_name("refused.csv"), PARTS))
def test_refused(tmp_path, row):
    read, error = READERS[row["reader"]]
    path = tmp_path / "wrong.csv"
    path.write_text(row["text"], encoding="utf-8")
    with pytest.raises(error, match=row["refused"]) as caught:
        read(path, row)
    assert "wrong.csv: " in str(caught.value)
    assert "\n" not in str(caught.value)
