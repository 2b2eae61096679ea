"""Tiny files of every record format, written from the published layouts: what readers are tested on anywhere."""

import re
from pathlib import Path

import numpy as np

from toppling.motions.pairs import pair_up
from toppling.motions.readers.directions import of_the_ground
from toppling.motions.readers.patterns import expand, is_pattern
from toppling.motions.readers.read import read_file

GALS = {"gal": 1.0, "g": 980.665, "cm/s2": 1.0, "m/s^2": 100.0}


def shaking(n=24, peak=50.0, seed=0):
    """A short record (n,) in the unit of its format, in steps of 0.01 so that every format can print it."""
    values = np.random.default_rng(seed).uniform(-1.0, 1.0, n)
    return np.round(peak * values / np.abs(values).max(), 2)


def _columns(values, per_line, form):
    words = [form % v for v in values]
    return "\n".join("".join(words[i : i + per_line]) for i in range(0, len(words), per_line)) + "\n"


def at2(values, dt=0.01, unit="G"):
    """PEER: the unit in the third line, count and step in the fourth."""
    return (
        "PEER STRONG MOTION DATABASE RECORD\nSOMEWHERE 01/01/00, STATION\n"
        f"ACCELERATION TIME HISTORY IN UNITS OF {unit}\nNPTS= {len(values)}, DT= {dt:.5f} SEC\n"
        + _columns(values, 5, "%15.7E")
    )


def csv(values, dt=0.01, unit="cm/s2"):
    rows = "".join(f"{i * dt:.4f},{v:.2f}\n" for i, v in enumerate(values))
    return f"time (s),acceleration ({unit})\n{rows}"


def knet(
    counts, scale="3920(gal)/6182761", direction="E-W", frequency="100Hz", duration=None, station="AOM001", peak=None
):
    """NIED: 17 lines, values in column 19, then eight counts a line; the peak is that about the mean."""
    if peak is None:
        known = re.fullmatch(r"(\d+)\((gal|g|cm/s2|m/s\^2)\)/([1-9]\d*)", scale)
        factor = float(known[1]) * GALS[known[2]] / float(known[3]) if known else 1.0
        peak = f"{factor * np.abs(counts - np.mean(counts)).max():.3f}"
    header = {
        "Origin Time": "2018/01/24 19:51:00",
        "Lat.": "41.0",
        "Long.": "142.5",
        "Depth. (km)": "30",
        "Mag.": "6.2",
        "Station Code": station,
        "Station Lat.": "41.5267",
        "Station Long.": "140.9244",
        "Station Height(m)": "39",
        "Record Time": "2018/01/24 19:51:43",
        "Sampling Freq(Hz)": frequency,
        "Duration Time(s)": len(counts) / 100.0 if duration is None else duration,
        "Dir.": direction,
        "Scale Factor": scale,
        "Max. Acc. (gal)": peak,
        "Last Correction": "2018/01/24 19:51:43",
        "Memo.": "",
    }
    lines = "".join(f"{name:<18}{text}\n" for name, text in header.items())
    return lines + _columns(counts, 8, "%8d ")


def esm(values, dt=0.005, unit="cm/s^2", quantity="ACCELERATION", count=None, vs30="760"):
    """ESM: keys and values (those that matter, of 64), one sample a line."""
    return (
        "EVENT_NAME: SOMEWHERE\nEVENT_ID: EMSC-20190728_0000106\nEVENT_DATE_YYYYMMDD: 20190728\n"
        "EVENT_TIME_HHMMSS: 160908\nMAGNITUDE_W: 5.1\nMAGNITUDE_L: 4.6\nNETWORK: HI\nSTATION_CODE: ARS1\n"
        f"LOCATION: \nVS30_M/S: {vs30}\nEPICENTRAL_DISTANCE_KM: 88.1\nSAMPLING_INTERVAL_S: {dt:.6f}\n"
        f"NDATA: {len(values) if count is None else count}\nSTREAM: HNE\nUNITS: {unit}\nDATA_TYPE: {quantity}\n"
        "USER1: a: b\nUSER5: \n" + "".join(f"{v:.6f}\n" for v in values)
    )


def cosmos(channels, dt=0.01, unit="cm/sec2(04)", form="(8F10.5)", per_line=8, printed="%10.5f", seconds=None):
    """COSMOS 1.20: 13 text lines, 100 integers, 100 reals, comments, blocks; `channels` holds lists of blocks."""
    text = ""
    for number, blocks in enumerate(channels, start=1):
        real = np.full(100, -999.0)
        real[[12, 16, 61]] = 6.7, 45.03, 1e3 * dt
        text += (
            "Corrected acceleration    (Format v01.20 with 13 text lines) Src: none\n"
            "Record of Somewhere Earthquake of Fri Nov 30, 2018 17:29 UTC\n"
            "Hypocenter: 34.0580  -117.0110  H= 12km\nOrigin: 06/16/2005, 20:53:26.1 UTC\n"
            "Statn No: 01-23075  Code:CE-J2236  Somewhere\nCoords: 34.0460 -117.0350\nRecorder: none\n"
            f"Rcrd start time:06/16/2005\nSta Cha:  {number}: {90 * number} deg (Rcrdr Chan  {number}) Location: none\n"
            "Raw record length = 70.000  sec\nProcessed: 06/17/2005\nRecord filtered below 0.30  Hz\n"
            "Values used when parameter or data value is unknown/unspecified:   -999, -999.0\n"
            " 100 Integer-header values follow on  10 lines, Format= (10I8)\n"
            + _columns([-999] * 100, 10, "%8d")
            + " 100 Real-header values follow on  17 lines, Format= (6F13.6)\n"
            + _columns(real, 6, "%13.6f")
            + '  1 Comment line(s) follow, each starting with a "|":\n| nothing\n'
        )
        for quantity, values in blocks:
            length = round(len(values) * dt) if seconds is None else seconds
            text += f"{len(values):7d}  {quantity} pts, approx {length:4d} secs, units={unit},Format={form}\n"
            text += _columns(values, per_line, printed)
        text += f"/&  ----------  End of data for channel  {number}  ----------\n"
    return text


def csmip(channels, dt=0.01, unit="cm/sec2", form="(8f10.6)", blocks=("accel", "veloc", "displ")):
    """CSMIP volume 2: 25 text lines, 100 integers, 100 reals, three blocks and the end for each channel."""
    text = ""
    for number, values in enumerate(channels, start=1):
        lines = [
            f"Corrected accelerogram   58667-L2866-14236.52       Chan  {number}:  H{number}         from   ",
            "Uncorrected Accelerogram Data             Processed: 08/24/14, CGS  667bv052    ",
            "Rcrd of Sun Aug 24, 2014 03:20:33.0 PDT               (Avol1 v0.8, 5/14 CSMIP)  ",
            "",
            "",
            "Station No. 58667   37.973N, 122.038W    Etna    s/n 2866  (3 Chns of  3 at Sta)",
            "Somewhere                 CGS   Data: Acceleration",
            f"Chan  {number}:  H{number}                                                          ",
            "",
            "Hypocenter:  To be determined.               ML: 4.2",
            *[""] * 15,
        ]
        text += "\n".join(lines) + "\n" + _columns([12345] * 100, 16, "%5d") + _columns([-999.0] * 100, 8, "%10.5f")
        for block in blocks:
            where = f", in {unit}. {form}" if block == "accel" else f", in cm/sec.  {form}"
            text += f"{len(values):6d} points of {block} data equally spaced at  {dt:.3f} sec{where}    \n"
            text += _columns(values, 8, "%10.6f")
        text += f"/&  ----------  End of data for channel  {number}  ----------\n"
    return text


def geonet(channels, dt=0.02, unit="mm/s/s", opening="Corrected accelerogram"):
    """GeoNet V2A: 16 text lines, 40 integers, 60 reals, three blocks of ten values a line for each component."""
    text = ""
    for name, values in channels.items():
        n = len(values)
        integers, reals = np.zeros(40), np.zeros(60)
        integers[[29, 33, 34, 35]] = 13, n, n, n
        reals[[14, 25]] = 4.17, dt
        text += (
            f"{opening} 20180212_211554_WPWS_20 GNS Science\n"
            "Site WPWS      39 56 38S  176 35 04E\nSomewhere\nInstrument\nResolution\nAccelerogram\n6 km south\n"
            "2018 February 12         21:15:54 UT\nEpicentre\n"
            f"Number of points  {n}    Duration 115.98 sec\nInstrument corrected data at {dt:.3f} sec intervals\n"
            f"Band-pass filter\nComponent {name}  Accelerometer Axis\n"
            f"Acceleration:  peak    {np.abs(values).max():.1f} {unit} at  43.68 sec     rms      2.2 {unit}\n"
            "Velocity:\nDisplacement:\n"
            + _columns(integers, 10, "%8d")
            + _columns(reals, 10, "%8.3f")
            + _columns(np.concatenate([values]), 10, "%8.1f")
            + 2 * _columns(values, 10, "%8.2f")
        )
    return text


COUNTS = np.arange(-100, 100)
SAMPLES = {
    "at2": at2(shaking(200, 0.4)),
    "csv": csv(shaking(200)),
    "knet": knet(COUNTS * 61),
    "esm": esm(shaking(200)),
    "cosmos": cosmos([[("acceleration", shaking(100))], [("acceleration", shaking(100, seed=1))]]),
    "csmip": csmip([shaking(100), shaking(100, seed=1)]),
    "geonet": geonet({"N": shaking(100), "E": shaking(100, seed=1)}),
}
"""A readable file of each format, for tests that damage it."""


def read_pairs(paths):
    """The joined components of some record files, or of patterns of them."""
    given = [str(path) for path in paths]
    found = [file for path in given for file in (expand(path, Path(), "paths") if is_pattern(path) else [Path(path)])]
    return pair_up(of_the_ground({file: read_file(file) for file in found}, given))
