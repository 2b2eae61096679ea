"""Words that options of commands take."""

from __future__ import annotations

from typing import Literal

CurveFormat = Literal["pelicun", "nrml", "csv"]
ExportFormat = Literal["pelicun", "nrml", "csv", "xlsx"]
Starter = Literal["bookcase", "hazard", "inventory", "records", "scenario"]
