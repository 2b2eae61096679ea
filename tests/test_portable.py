"""Uses of numpy's wide loops, of BLAS, LAPACK and scipy's algorithms in the product stand in `portable.csv`.

It has a row a kind and file (or folder), which says why its bits do not matter or do not differ between processors.
Results of a study have the same bits on every x86-64 with FMA: use `core.elementary`, and
write powers of arrays but for 2, 1/2 and -1 as `power`, which no pattern can find.
"""

import csv
import re
from pathlib import Path

import pytest

pytestmark = pytest.mark.repository

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("core", "models", "motions", "fragility", "studies")
LOOPS = (
    *("exp", "exp2", "expm1", "log", "log2", "log10", "log1p", "logaddexp", "logspace", "geomspace", "power"),
    *("float_power", "cbrt", "tan", "arcsin", "arccos", "arctan", "arctan2", "sinh", "cosh", "arcsinh", "arccosh"),
    *("arctanh", "angle", "i0", "gradient", "unwrap"),
)
PRODUCTS = (
    *("dot", "vdot", "inner", "matmul", "vecmat", "matvec", "tensordot", "convolve", "correlate", "polyfit", "cov"),
    *("corrcoef", "poly", "roots"),
)
KINDS = {
    "loop": rf"\bnp\.({'|'.join(LOOPS)})\b",
    "product": rf"\bnp\.({'|'.join(PRODUCTS)})\b|\.dot\(| @ |\boptimize=True",
    "linalg": r"\b(np|scipy)\.linalg\.(?!LinAlgError)|\bleggauss\b",
    "order": r"\bargsort\((?!.*kind=\"stable\")|\bargpartition\(",
    "scipy": r"\bscipy\.(signal|stats|interpolate|integrate|optimize|sparse|spatial|fft|ndimage|cluster)\.\w+",
}
"""Patterns of what has other bits on other processors, or of libraries that may use it."""
KERNELS = re.compile(r"/(kernels|engine|slip)/")


def used(text, pattern):
    """Whether a pattern is in the code of a file: not in comments, docstrings and examples."""
    code = re.sub(r'"""(?s:.*?)"""', "", text)
    code = re.sub(r"(?m)#.*$", "", re.sub(r"\"[^\"\n]*\"", lambda m: m[0] if "stable" in m[0] else '""', code))
    return re.search(pattern, code) is not None


def found():
    """The kinds that each file uses; compiled code takes numpy's functions from the C library, one value at a time."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            text = path.read_text(encoding="utf-8")
            for kind, pattern in KINDS.items():
                if used(text, pattern) and not (kind == "loop" and KERNELS.search(name)):
                    yield kind, name


def rows():
    with (Path(__file__).parent / "portable.csv").open(encoding="utf-8", newline="") as file:
        return [(row["kind"], row["file"], row["reason"]) for row in csv.DictReader(file)]


def of_row(kind, file, use):
    return use[0] == kind and (use[1] == file or (file.endswith("/") and use[1].startswith(file)))


def test_every_use_stands_in_the_table():
    table = rows()
    assert [use for use in found() if not any(of_row(kind, file, use) for kind, file, _ in table)] == []


def test_every_row_has_a_use_and_a_reason():
    uses = [*found()]
    assert [row for row in rows() if not row[2] or not any(of_row(*row[:2], use) for use in uses)] == []


@pytest.mark.parametrize(
    ("kind", "text"),
    [
        ("loop", "y = np.exp(x)"),
        ("loop", "f(np.log1p, x)"),
        ("product", "y = a @ b"),
        ("product", "y = array.dot(weights)"),
        ("linalg", "values = np.linalg.eigvalsh(a)"),
        ("order", "order = np.argsort(values)"),
        ("scipy", "scipy.stats.norm.ppf(p)"),
    ],
)
def test_a_use_is_seen(kind, text):
    assert used(text, KINDS[kind])


@pytest.mark.parametrize(
    "text", ["# np.exp(x)", '"""a @ b"""', 'raise ValueError("a @ b")', 'np.argsort(x, kind="stable")']
)
def test_words_are_no_use(text):
    assert not any(used(text, pattern) for pattern in KINDS.values())
