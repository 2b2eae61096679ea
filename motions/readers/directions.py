"""Directions of components in files, headers and file names, and vertical components among records."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import cache
from itertools import compress
from pathlib import Path

import xarray as xr

from ...core.doubts import Doubt, first_names, warn
from ...core.wording import counted
from .lines import RecordError, folded

_SURE = (
    r"(?:上下)?ud[12]?|z|[beh][hnlg]z|vert(?:i[ck]\w*)?|верт\w*|dusey|dikey|senkrecht\w*|pionow\w*|svisl\w*|κατακορυφ\w*|上下|"
    "[鉛铅垂竖][直向]?|수직|상하|عمودی?|قائم"
)
"""Words, without accents, for a vertical component anywhere in a name; other words must be the whole name."""
_UPRIGHT = re.compile(_SURE, re.IGNORECASE)
_VERTICAL = re.compile(
    rf"{_SURE}|up(?:down|ward\w*)?|down(?:up|ward\w*)?|dwn|dn|ver|vrt|[vz]\d?|u|zup|dus?|heave", re.IGNORECASE
)
BOREHOLE, STRUCTURE = " borehole", " structure"
"""End of the direction of a component that is no motion of the ground's surface."""
_PLACE = re.compile(rf"[-_ ]+(?:surface|downhole|{BOREHOLE[1:]}|{STRUCTURE[1:]})$", re.IGNORECASE)
_AWAY = re.compile(rf"\b(?:borehole|downhole)\b|{STRUCTURE}$", re.IGNORECASE)
_BELOW = re.compile(r"down-?hole|bore-?hole|\bdepth\b|\bdeep\b|-\s?\d+(?:\.\d+)?\s*(?:m|ft)\b", re.IGNORECASE)
_ABOVE = re.compile(
    r"(?i)\broof\b|\bpenthouse|\bdeck\b|\bcrest\b|\b(?:[2-9]|\d\d)(?:st|nd|rd|th) (?:floor|story|level)\b|"
    r"\b(?:second|third|fourth|fifth|sixth|top) (?:floor|story|level)\b|\bfloor (?:[2-9]|\d\d)\b|\bazotea|屋上|"
    r"(?-i:\b[1-5]?\dF\b)|\b(?:[2-9]|\d\d)\. ?OG\b|\bmid-?span\b|"
    r"\btop of (?:the )?(?:specimen|shelf|bookcase|cabinet|building)|"
    r"\bon (?:the |a )?(?:shelf|bookcase|cabinet|rack)|\b(?:specimen|bookcase|cabinet) top\b"
)
_BURIED = re.compile(
    r"(?i)\b(?:down-?hole|bore-?hole)|地下\s?\d+\s?m|(?<!upper )(?<!to )(?<!over )(?<!top )\b\d+(?:\.\d+)?\s?m depth"
)
"""Places of a sensor at the end of a line of words, which speak of depths of many things."""
_POINTS = {
    0.0: r"n(?:orth|o?ord|orte)?(?:s(?:outh|u[drl]|ued)?)?|noordzuid|kuzey(?:guney)?|kg?|gk|南?北|남북|"
    r"север(?:юг)?|[сю]{2}|βορρα\w*|βν",
    90.0: r"e(?:ast|ste?)?(?:w(?:est)?|o(?:vest|uest|este)?)?|leste(?:oeste)?|ost|o(?:st)?w(?:est)?|[wo]e|"
    r"oost(?:west)?|dogu(?:bati)?|db|bd|[东東]西?|동서|восток(?:запад)?|[вз]{2}|ανατολ\w*|αδ",
    180.0: r"s(?:outh|u[drl]|ued)?|zuid|guney|南|юг|νοτος?",
    270.0: r"w(?:est)?|o(?:vest|uest|este)|bati|西|запад",
}
"""Points of the compass without accents, alone and in pairs, by their azimuth in degrees."""
_BEARING = re.compile(r"([NS])(\d{1,2})([EW])", re.IGNORECASE)
_DEGREES = re.compile(r"(\d{1,3})(?:\s*deg(?:rees)?)?", re.IGNORECASE)
# SEED: band, instrument, orientation, location; CH1 is a channel of any recorder, HN3 any of three directions.
_CODE = re.compile(r"(?!CH\d)[BEHLSCVM][HNLG]([NEZ12])(?:\.?\d\d)?")
_CHANNELS = re.compile(
    r"(?:ch(?:an(?:nel)?)?|comp(?:onent)?|canale?|kanal|axis|dir(?:ection)?)[0-3]|\d{3}[a-z]{3}\d{11,}0[1-3]",
    re.IGNORECASE,
)
"""Words that number the three components of a recorder, also in names of China's network."""
_EUROPEAN = re.compile(r"(?<=\d{4})([xyz])[a-z]?$", re.IGNORECASE)
"""End of a name of the European Strong-motion Database, such as 000055za."""
_LEVEL = re.compile(  # (horizontal, of no known azimuth)
    r"[lthxy]\d?|long?|tran?|trn|xte|yln|(?:ns|ew)[12]|[fs][np]|surge|sway|yatay|boyuna|enine|langs|quer|[水横纵縦수][平평]?\d?|"
    r"(?:fault|strike)(?:normal|parallel)|(?:hor|(?:horiz|longit|tra[ns]{1,2}v|radial|tang|lateral|гориз|прод|попер|οριζ)\w*)\d?",
    re.IGNORECASE,
)
_UNIT = re.compile(  # as in a table's heading: "(g)", "[cm/s²]", "_m_s2"
    r"\s*(?:\([^()]*\)|\[[^\[\]]*\])\s*$|(?<=[a-z])(?:[-_. ]+(?:gal|g|[cm]?m_?s-?2))+$", re.IGNORECASE
)
_KEY = (
    r"(?:[ck]omp(?:onent\w*|osante)?|k?cmp(?:nm)?|dir|direction|richtung|direzione|direccion|ch|chan(?:nel)?|canale?|"
    r"stream|sensor|orientation|axis|seed|bilesen|συνιστωσα|składowa|slozka|"
    r"компонента|составляющая|성분|[成分]分|分量|分向|方向)(?: (?:name|code|id))?\.?"
)
_STATED = re.compile(
    rf"(?i)(?<![a-z]){_KEY}\s*\d?\s*(?:[:=：](?!\s*[a-z]:[\\/])\s*(?P<direction>[^,;#|]{{1,30}})"
    r"|\s(?P<last>(?!v\b)[^\s,;:=]{1,12})\s*(?=$|[,;|]))"
)
_SEED_CODES = re.compile(
    r"(?<![A-Za-z0-9])[A-Z0-9]{1,2}[._][A-Z0-9]{1,5}(?:[._][A-Z0-9]{0,2})?[._]([BEHLSCVM][HNLG][A-Z0-9])(?![A-Za-z0-9])"
)
"""Codes of channels in SEED, below their network and station: XX.ABC..HNZ."""
_LETTERS = re.compile(r"[uv]\d?", re.IGNORECASE)
_OF_CHANNEL = re.compile(
    rf"(?i)(?<![\w.-])(?:{_KEY}|col(?:umn)?)?\s*(?P<number>[1-9])\s*[:=]\s*(?P<direction>[^,;#|]{{1,30}})"
)
"""Direction of a channel by its number: "channel 1 = NS; channel 2 = UP"."""
_NUMBERED = re.compile(rf"(?i)(?:{_KEY}|a|acc\w*?)?[-_ ]?(?P<number>[1-9])(?![\d])")
"""Name of a column by the number of its channel."""
_UPWARD = re.compile(
    r"(?i)(?<!no )(?<!without )\bverti[ck]al\w*\s?(?:comp(?!onents)|komp|acc|motion|record|direction)"
    r"(?!\w*\W+positive|\w* (?:is )?(?:not|left|removed))"
    r"|\b(?:[ck]ompon|acc)\w*\W{1,3}verti[ck]al\w*|\b(?:dip|inclination)\s*[:=]?\s*-90\b"
    r"|(?-i:\bC(?:OMP|omp)(?:ONENT|onent)?\.?\s+(?:UP|UD|DOWN|Z|V)\b)"
)
"""Lines of a header about a sensor that stands upright."""
_CHANNEL = re.compile(r"(?:chan(?:nel)?\s*\d{1,3}:?|\d{1,3}:)\s*", re.IGNORECASE)
# Words apart, and those around a direction: "acc_z", "AccelZ", "vertical component", "UD成分".
_APART = re.compile(
    r"[-_.,:/+()\[\]\s]+|(?<=[a-z])(?=[A-Z])(?!(?<=\bg)F[xyz]\b)|(?i:(?<=\b[xyz])(?=axis)|(?<=\bcomp)(?=v|up|ud|z))|成分|方向|加速度|[軸轴動动向]"
)
_AROUND = re.compile(
    r"^(?:(?:a(?:cc(?:el)?)?|gf)(?=[xyz]$)|(?:a|acc\w*|a[ck]c?el\w*|beschl\w*|ivme\w*|[ck]omp\w*|dir\w*|axis|linear)$)",
    re.IGNORECASE,
)
_TURNING = re.compile(r"rot|gyr|theta|omega", re.IGNORECASE)
_NAME = re.compile(
    r"(?i)(?P<base>.+?)(?:(?P<apart>[-_. 平下]*)(?P<direction>\d{3}|[ns]\d{1,2}[ew]|zup|up|dwn|down|dn|vrt|vert?|ver|"
    r"(?:ns|ew|ud)[12]?|we|h1|h2|v[123]|上下|南北|[东東]西|[nsewvz])|[-_. ]+(?P<letter>[ltvxyzu]\d?|long?|tran?|trn))"
)
_PAIR = re.compile(r"(?<=[-_. ])([KNUDEO])-([GSDBWO])(?![a-z\d])", re.IGNORECASE)
"""Two points of the compass with a hyphen between, "N-S"."""
_KNET = re.compile(r"\.(?P<direction>NS|EW|UD)(?P<place>[12]?)", re.IGNORECASE)
_RECORDING = re.compile(r"RSN\d+(?=_)")  # of the NGA databases


LEFT_OUT = "left_out"
"""Attribute of the first array of those read: names of the vertical components that are left out."""
ANOTHER = math.sin(math.radians(2.0))
"""Sine of the angle between two directions from which they are not one."""
ON_PURPOSE, BY_ITSELF = "component = 'v', or a file named by itself, takes them", "a file named by itself is taken"
"""Instructions for taking vertical components on purpose: in a study, and elsewhere."""


@cache
def direction_of(text: str, anywhere: bool = True) -> tuple[bool, float] | None:
    """Return True if a written direction is vertical, and its azimuth, rad (NaN: unknown); None without a direction.

    Sure words for a vertical one count `anywhere` in the text, otherwise only if no other words are in it.
    """
    text = _CHANNEL.sub("", folded(text), count=1).strip()
    every = [word for word in _APART.split(_PLACE.sub("", _UNIT.sub("", text))) if word]
    words = [word for word in (_AROUND.sub("", word) for word in every) if word]
    if not anywhere and len(words) > 1:
        return None
    word = "".join(words)
    code = _CODE.fullmatch(word.upper())
    if _VERTICAL.fullmatch(word) or (code and code[1] == "Z"):
        return True, math.nan
    plain = code[1] if code else word.upper()
    point = next((azimuth for azimuth, points in _POINTS.items() if re.fullmatch(points, plain, re.IGNORECASE)), None)
    if point is not None:
        return False, math.radians(point)
    bearing = _BEARING.fullmatch(plain)
    if bearing:
        along = 0.0 if bearing[1] == "N" else 180.0
        clockwise = 1.0 if bearing[1] + bearing[3] in ("NE", "SW") else -1.0
        return False, math.radians((along + clockwise * float(bearing[2])) % 360.0)
    degrees = _DEGREES.fullmatch(plain)
    if degrees and not code and words == every and float(degrees[1]) <= 360.0:
        return False, math.radians(float(degrees[1]) % 360.0)
    if code or _LEVEL.fullmatch(word):
        return False, math.nan
    upright = anywhere and any(map(_UPRIGHT.fullmatch, _APART.split(text))) and not _TURNING.search(text)
    return (True, math.nan) if upright and not {"NS", "EW"} & set(every) else None


def vertical_of(header: Iterable[str]) -> str:
    """Return the direction that lines of words give to a single component if it is vertical, '' otherwise."""
    for text in header:
        line = text.strip("# \t*")
        upward, words = _UPWARD.search(text), [(of[1] or of[2]).strip() for of in _STATED.finditer(folded(text))]
        stated = next((word for word in words if direction_of(word)), "")
        if stated:
            if (direction_of(stated) or (False,))[0]:
                return stated
        elif (codes := _SEED_CODES.findall(text)) and all(code.endswith("Z") for code in codes):
            return str(codes[0])
        elif (whole := direction_of(line, False)) and whole[0] and not _LETTERS.fullmatch(line):
            return line[:30]
        elif upward and not re.search("horizontal", text, re.IGNORECASE):
            return "UP"
    return ""


def channels_of(header: Iterable[str]) -> dict[str, str]:
    """Return the directions that lines of words give to channels, by the number of each."""
    matches = (match for text in header for match in _OF_CHANNEL.finditer(text))
    return {
        match["number"]: match["direction"].strip() for match in matches if direction_of(match["direction"].strip())
    }


def channel_of(name: str, channels: Mapping[str, str]) -> str:
    """Return the name of a column with the direction of its channel, as it is if it has its own or none is known."""
    numbered = None if direction_of(name) else _NUMBERED.match(name)
    direction = channels.get(numbered["number"]) if numbered else None
    return f"Chan {numbered['number']}: {direction}" if numbered and direction else name


def said_of(motion: xr.DataArray) -> str:
    """Return the direction of one motion as its file gives it, '' if it gives none."""
    component = motion.coords.get("component")
    return str(component.values[0]) if component is not None and component.dims == ("motion",) else ""


def place_of_sensor(text: str) -> str:
    """Return the end of a direction from a header's text on a sensor's place, '' on the ground."""
    return BOREHOLE if _BELOW.search(text) else STRUCTURE if _ABOVE.search(text) else ""


def place_of(header: Iterable[str]) -> str:
    """Return the end of a direction if a cell of lines of words ends in a sensor's place, '' on the ground."""
    for cell in (cell.strip("# .)\t") for text in header for cell in re.split("[,;|]", text)):
        for end, pattern in ((STRUCTURE, _ABOVE), (BOREHOLE, _BURIED)):
            if any(match.end() == len(cell) for match in pattern.finditer(cell)):
                return end
    return ""


def _of_title(motion: xr.DataArray) -> tuple[bool, float] | None:
    """Return the direction at the end of an AT2 file's second line: "Somewhere, 1/2/1999, Station, 090"."""
    start, _, end = str(motion.attrs.get("title", "")).rpartition(",")
    return direction_of(end) if start and "/" in start and len(end.split()) < 3 else None


def header_of(motion: xr.DataArray) -> str:
    """Return the station and the event of one motion by its file, without the time of day."""
    source = Path(str(motion["source"].values[0])).stem if "source" in motion.coords else ""
    texts = [str(motion[key].values[0]) for key in ("station", "event") if key in motion.coords]
    title = str(motion.attrs.get("title", "")).rpartition(",")[0] if _of_title(motion) else ""
    return " ".join(re.sub(r"\d+:\d.*", "", text).strip() for text in (*texts, title) if text != source)


def _doubt_title(path: Path, word: str, motion: xr.DataArray) -> None:
    """Warn of an AT2 file whose second line names another direction than its name, which is taken."""
    named, title = direction_of(word) if word else None, _of_title(motion)
    if named and title and (named[0] != title[0] or abs(math.sin(named[1] - title[1])) > ANOTHER):
        end = motion.attrs["title"].rpartition(",")[2].strip()
        warn([Doubt.of("title", file=path.name, end=end, word=word)])


def are_vertical(array: xr.DataArray) -> list[bool]:
    """Return True for each motion of an array that is a vertical component by its file."""
    component, title = array.coords.get("component"), _of_title(array)
    along = (
        component.values if component is not None and component.dims == ("motion",) else [""] * array.sizes["motion"]
    )
    return [(direction_of(str(text)) or title or (False, math.nan))[0] for text in along]


def of_file(path: Path, motion: xr.DataArray) -> tuple[bool, float, str, str]:
    """Return whether the only motion of a file is vertical, its azimuth (rad, NaN: not known), its source, recording.

    The direction is from the file, otherwise from its name, otherwise from its title. The recording is named by the
    record sequence number of the NGA databases, by the name without its direction, or by the station and event.
    """
    stated, title = direction_of(said_of(motion)), _of_title(motion)
    (word, base, _), number = _named(path), _RECORDING.match(path.stem)
    base = number[0] if number and not _KNET.fullmatch(path.suffix) else base
    _doubt_title(path, word, motion)
    direction = stated or (direction_of(word) if word else None) or title
    if not base and direction:
        code = said_of(motion)[:2] if _CODE.fullmatch(said_of(motion)) else ""
        where = [str(motion[key].values[0]) for key in ("station", "event") if key in motion.coords]
        base = " ".join([*where, code]) if where else str(motion.attrs.get("title", "")).rpartition(",")[0]
    if not base or (direction is None and not number):
        raise RecordError(
            f"{path}: its name gives no direction, such as an ending 090 or -N, to find its other components by"
        )
    source = "header" if stated else "file name" if word and direction_of(word) else "second line"
    return *(direction or (False, math.nan)), source, f"{path.parent}/{base}"


def _named(path: Path) -> tuple[str, str, bool]:
    """Return the direction at the end of a file's name, the name without it, and True if it is set apart."""
    suffix, name = _KNET.fullmatch(path.suffix), _NAME.fullmatch(_EUROPEAN.sub(r"_\1", path.stem))
    if suffix is not None:
        return suffix["direction"], f"{path.stem}.{suffix['place']}", True
    if name is None:
        return "", "", False
    word = name["direction"] or name["letter"]
    return word, name["base"], bool(name["letter"] or name["apart"]) and not word[-1].isdigit()


_Words = list[tuple[str, list[str]]]
"""Words of a file's name, each with the words in its place in names that are otherwise the same."""


def _siblings(paths: Collection[Path]) -> dict[Path, _Words]:
    """Return the words of each file's name."""
    names: dict[tuple[Path, int, tuple[str, ...]], list[str]] = {}
    siblings = {}
    for path in paths:
        words = _APART.split(_PAIR.sub(r"\1\2", path.stem))
        keys = [(path.parent, at, (*words[:at], *words[at + 1 :])) for at in range(len(words))]
        siblings[path] = [(word, names.setdefault(key, [])) for word, key in zip(words, keys, strict=True)]
        for word, variants in siblings[path]:
            variants.append(word)
    return siblings


def _levels(words: Iterable[str]) -> list[bool | None]:
    """Return True for each word of a horizontal component, False for a vertical one, None for neither."""
    return [None if direction is None else not direction[0] for direction in map(direction_of, words)]


def _is_vertical(path: Path, motion: xr.DataArray, alone: bool, siblings: Mapping[Path, _Words]) -> bool:
    """Return True if a motion is a vertical component by its file; by a name alone if others differ in a word."""
    direction = direction_of(said_of(motion))
    if direction is not None or not alone:
        return direction is not None and direction[0]
    title, (word, base, marked) = _of_title(motion), _named(path)
    if title is not None and title[0]:
        _doubt_title(path, word, motion)
    if _levels([word]) == [False]:
        rests = (sibling.stem[len(base) :].lstrip("-_. ") for sibling in siblings if sibling.stem.startswith(base))
        return marked or True in _levels(rests)
    for part, variants in siblings[path]:
        if _levels([part]) == [False] and ((len(part) > 1 and _UPRIGHT.fullmatch(part)) or True in _levels(variants)):
            return True
    return title is not None and title[0] and re.search(r"\d{3}$", path.stem) is None


def doubt_three(name: str, arrays: Sequence[xr.DataArray]) -> None:
    """Warn of three components of a file, none of them vertical and one without a direction."""
    levels = _levels(said_of(array.isel(motion=[i])) for array in arrays for i in range(array.sizes["motion"]))
    if len(levels) == 3 and None in levels and False not in levels:
        warn([Doubt.of("none_upright", named=name)])


def _one_of_three(arrays: Sequence[xr.DataArray], words: _Words) -> bool:
    """Return True if a file is one of three components, none of them vertical and one without a direction."""
    motions = [array.isel(motion=[i]) for array in arrays for i in range(array.sizes["motion"])]
    if len(motions) > 1 or _levels(map(said_of, motions)) != [None] or _of_title(motions[0]):
        return False
    # (numbers of one or two digits are no azimuths)
    unknown = [variants for word, variants in words if len(variants) == 3 and direction_of(word) is None]
    groups = [_levels(re.sub(r"^\d\d?$", "", variant) for variant in variants) for variants in unknown]
    numbered = any(all(map(_CHANNELS.fullmatch, variants)) for variants in unknown)
    return numbered or any(True in group and False not in group for group in groups)


def of_the_ground(
    read: Mapping[Path, Sequence[xr.DataArray]], patterns: Iterable[str], folder: Path = Path()
) -> dict[Path, Sequence[xr.DataArray]]:
    """Return motions read from files without components of boreholes and structures, which a note names.

    A file that is named by itself and contains nothing else is kept, and everything if there is nothing else.
    """
    named = {folder / pattern for pattern in patterns}
    kept: dict[Path, Sequence[xr.DataArray]] = {}
    out: list[str] = []
    for path, arrays in read.items():
        parts = [array.isel(motion=[i]) for array in arrays for i in range(array.sizes["motion"])]
        away = [_AWAY.search(said_of(motion)) is not None for motion in parts]
        if not any(away) or (path in named and all(away)):
            kept[path] = arrays
            continue
        out += [str(motion["motion"].values[0]) if len(parts) > 1 else path.name for motion in compress(parts, away)]
        if not all(away):
            kept[path] = [motion for motion, far in zip(parts, away, strict=True) if not far]
    if out:
        components = {"of": counted(len(out), "component"), "named": first_names(out)}
        if not kept:
            warn([Doubt.of("away_from_ground", **components)])
            return dict(read)
        warn([Doubt.of("away_left_out", **components)])
    return kept


def horizontal_motions(
    read: Mapping[Path, Sequence[xr.DataArray]],
    patterns: Iterable[str],
    folder: Path = Path(),
    vertical: bool = False,
    cure: str = BY_ITSELF,
) -> list[xr.DataArray]:
    """Return motions read from files without vertical components; the first array names the omitted components.

    A file that is named by itself, not by a pattern, and contains nothing else is kept. With `vertical`, vertical
    components alone are kept. `cure`: instruction for the caller to take vertical components on purpose.
    """
    read = of_the_ground(read, patterns, folder)
    named = {folder / pattern for pattern in patterns}
    siblings = _siblings(read)
    horizontal: list[xr.DataArray] = []
    out: list[str] = []
    unknown: list[str] = []
    for path, arrays in read.items():
        alone = sum(array.sizes["motion"] for array in arrays) == 1
        unknown += [path.name] * _one_of_three(arrays, siblings[path])
        for array in arrays:
            parts = [array.isel(motion=[i]) for i in range(array.sizes["motion"])]
            upright = [_is_vertical(path, motion, alone, siblings) for motion in parts]
            kept = [i for i, up in enumerate(upright) if up == vertical or (path in named and all(upright))]
            out += [
                path.name if alone else str(array["motion"].values[i]) for i in range(len(upright)) if i not in kept
            ]
            if kept:
                horizontal.append(array if len(kept) == len(upright) else array.isel(motion=kept))
    if not horizontal:
        what = "is vertical" if vertical else f"is horizontal: {cure}"
        raise RecordError(f"{', '.join(str(path) for path in list(read)[:3])}: none of these records {what}")
    if unknown and not vertical:
        warn([Doubt.of("none_upright", named=first_names(unknown))])
    if out and not vertical:
        horizontal[0] = horizontal[0].assign_attrs({LEFT_OUT: tuple(out)})
    return horizontal
