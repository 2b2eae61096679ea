"""Writers of film files by frames, two in memory at a time: GIF directly, MP4 through ffmpeg; whole files or none."""

import io
import shutil
import struct
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...core.writing import whole_file

Pixels = NDArray[np.uint8]
FRAME_RATES = (5, 10, 20, 25, 50)
"""Frame rates of a GIF, 1/s, whose clock counts hundredths of a second."""
SUFFIXES = (".gif", ".mp4")
MOST_COLOURS = 255
"""Maximum palette of a GIF, without the transparent colour that leaves the previous frame visible."""


def ffmpeg() -> str | None:
    """Return the path of the ffmpeg program; None if it is not installed."""
    return shutil.which("ffmpeg")


@contextmanager
def film(path: Path, fps: int, size: tuple[int, int], colours: Sequence[str]) -> "Iterator[_Gif | _Mp4]":
    """Open a film of `size` (width, height, both even) at `path`, .gif or .mp4; if the block fails, there is no file.

    `add` appends a frame, RGB of shape (height, width, 3); OSError if it cannot be written. `colours` are the palette
    of a GIF (at most 255, ``#rrggbb``), of which every pixel gets the nearest.
    """
    with whole_file(path) as temporary:
        made = _Gif(temporary, fps, size, colours) if path.suffix == ".gif" else _Mp4(temporary, fps, size)
        try:
            yield made
            made.close()
        finally:
            made.abandon()


class _Gif:
    """A GIF of changed rectangles with one palette, chained here: Pillow's own writer keeps every frame in memory."""

    def __init__(self, path: Path, fps: int, size: tuple[int, int], colours: Sequence[str]) -> None:
        if not 1 <= len(colours) <= MOST_COLOURS:
            raise ValueError(f"colours must be 1 to {MOST_COLOURS}, got {len(colours)}")
        table = b"".join(bytes.fromhex(colour.removeprefix("#")) for colour in colours)
        self._palette = Image.new("P", (1, 1))
        self._palette.putpalette(table)
        self._clear = len(colours)  # index of the transparent colour, which shows the previous frame
        self._delay = 100 // fps
        self._last: Pixels | None = None
        bits = self._clear.bit_length()
        self._file: BinaryIO = path.open("wb")
        self._file.write(b"GIF89a" + struct.pack("<HHBBB", *size, 0xF0 | (bits - 1), 0, 0))
        self._file.write(table.ljust(3 << bits, b"\0"))
        self._file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # the film repeats without end

    def add(self, frame: Pixels) -> None:
        now = np.asarray(Image.fromarray(frame).quantize(palette=self._palette, dither=Image.Dither.NONE))
        top, bottom, left, right = 0, now.shape[0], 0, now.shape[1]
        seen, flags = now, 0x04  # the frame stays visible under the next
        if self._last is not None:
            changed = now != self._last
            rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
            top, bottom = (int(rows[0]), int(rows[-1]) + 1) if rows.size else (0, 1)
            left, right = (int(columns[0]), int(columns[-1]) + 1) if columns.size else (0, 1)
            seen, flags = np.where(changed, now, np.uint8(self._clear)), 0x05
        self._last = now
        control = struct.pack("<BHBB", flags, self._delay, self._clear, 0)
        self._file.write(b"\x21\xf9\x04" + control + _image_block(seen[top:bottom, left:right], (left, top)))

    def close(self) -> None:
        self._file.write(b"\x3b")
        self._file.flush()

    def abandon(self) -> None:
        with suppress(OSError):
            self._file.close()


def _image_block(indices: Pixels, corner: tuple[int, int]) -> bytes:
    """Return the descriptor and the compressed indices of an image at `corner`, as a GIF stores them."""
    image = Image.fromarray(np.ascontiguousarray(indices))
    image.putpalette(bytes(3 * 256))  # (any palette, since the film has its own)
    buffer = io.BytesIO()
    image.save(buffer, "GIF", optimize=False, interlace=False)
    content = buffer.getvalue()
    at = 13 + (3 << ((content[10] & 0x07) + 1))  # skip the header and its palette
    while content[at] == 0x21:  # skip extensions, which consist of sub-blocks
        at += 2
        while content[at]:
            at += content[at] + 1
        at += 1
    return b"\x2c" + struct.pack("<HH", *corner) + content[at + 5 : -1]


class _Mp4:
    """An MP4: raw frames are passed to ffmpeg, which uses the best encoder that it has."""

    def __init__(self, path: Path, fps: int, size: tuple[int, int]) -> None:
        program = ffmpeg()
        if program is None:
            raise OSError("ffmpeg is not on the PATH, and MP4 needs it")
        path.open("wb").close()  # fails at once where the file cannot be written
        raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", str(fps), "-i", "-"]
        plain = ["-map_metadata", "-1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-movflags", "+faststart"]
        self._messages = tempfile.TemporaryFile()  # noqa: SIM115 - closed in abandon
        self._process = subprocess.Popen(
            [program, "-loglevel", "error", "-y", *raw, "-pix_fmt", "yuv420p", *plain, "-f", "mp4", str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._messages,
        )

    def add(self, frame: Pixels) -> None:
        assert self._process.stdin is not None  # a pipe, above
        try:
            self._process.stdin.write(np.ascontiguousarray(frame).data)
        except BrokenPipeError:
            raise self._failure() from None

    def close(self) -> None:
        assert self._process.stdin is not None
        with suppress(BrokenPipeError):
            self._process.stdin.close()
        if self._process.wait() != 0:
            raise self._failure()

    def abandon(self) -> None:
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
        with suppress(OSError):
            assert self._process.stdin is not None
            self._process.stdin.close()
        self._messages.close()

    def _failure(self) -> OSError:
        self._process.wait()
        self._messages.seek(0)
        lines = self._messages.read().decode(errors="replace").strip().splitlines()
        return OSError(f"ffmpeg failed: {lines[-1] if lines else f'exit code {self._process.returncode}'}")
