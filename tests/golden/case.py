"""A case of the golden corpus: files in a folder of their own, and the commands that are run there in order.

Nothing here or in the modules of cases imports toppling: the same list is run by every version of it.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

HERE = Path(__file__).parent
ROOT = HERE.parents[1]


class Case(NamedTuple):
    """A folder of files and the commands that are run in it.

    name: its place in the corpus, as ``studies/office`` or ``refused/lean_of_91_degrees``.
    files: names in the folder, and the text, the bytes or the source file of each.
    commands: arguments of `toppling`, or of Python if the first is ``python``.
    names: what a refusal must name on standard error, a key, a column, a line or a file; none if nothing is refused.
    process: True if every command is a process of its own, for what ends the process or is interrupted.
    twins: files that take the place of those of the same names under an old commit, as for functions renamed since.
    renamed: the last commit that needs the twins.
    """

    name: str
    files: Mapping[str, str | bytes | Path]
    commands: Sequence[Sequence[str]]
    names: Sequence[str] = ()
    process: bool = False
    twins: Mapping[str, str | bytes | Path] = {}
    renamed: str = ""

    def write(self, folder: Path) -> None:
        """Write the files into a new folder."""
        folder.mkdir(parents=True)
        for name, content in self.files.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if isinstance(content, Path):
                path.write_bytes(content.read_bytes())
            elif isinstance(content, bytes):
                path.write_bytes(content)
            else:
                path.write_text(content, encoding="utf-8", newline="")
