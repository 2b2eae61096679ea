"""Cases of the command: every command with every option, of `commands.toml`; `refused/options.toml` has wrong uses."""

import math
import shlex
import tomllib
from collections.abc import Iterator, Mapping
from typing import Any

from case import HERE, Case


def record(step: float, height: float, pace: float, middle: int, width: float, samples: int) -> str:
    """Return a sine under a bell as a table of times and accelerations."""
    rows = (
        f"{step * i:.2f},{height * math.sin(pace * i) * math.exp(-(((i - middle) / width) ** 2)):.6f}\n"
        for i in range(samples)
    )
    return "time_s,acceleration_g\n" + "".join(rows)


RECORDS = {
    "record": record(0.02, 0.5, 0.25, 60, 30.0, 151),
    "other record": record(0.01, 0.4, 0.1, 100, 50.0, 301),
}


def cases() -> list[Case]:
    """Return all cases of the command."""
    content = tomllib.loads((HERE / "commands.toml").read_text(encoding="utf-8"))
    texts = dict(RECORDS)
    for name, text in content.pop("texts").items():
        texts[name] = text if isinstance(text, str) else "".join(texts[part] for part in text)
    return [case for group, entries in content.items() for case in _of_group(group, entries, texts)]


def _of_group(group: str, entries: Mapping[str, Any], texts: Mapping[str, str]) -> Iterator[Case]:
    for name, entry in entries.items():
        files = {file: _content(content, texts) for file, content in entry.get("files", {}).items()}
        commands = [shlex.split(line) for line in entry["commands"]]
        yield Case(f"{group}/{name}", files, commands, entry.get("names", ()), group == "processes")


def _content(content: Any, texts: Mapping[str, str]) -> str:
    if isinstance(content, dict):
        return content["text"]
    base, *pairs = [content] if isinstance(content, str) else content
    text = texts[base]
    for old, new in zip(pairs[::2], pairs[1::2], strict=True):
        text = text.replace(old, new)
    return text
