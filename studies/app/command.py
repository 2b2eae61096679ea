"""The command `toppling app`: serves the live page on this machine until it is interrupted."""

from __future__ import annotations

import secrets
import socket
import threading
import webbrowser
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..command.choices import whole

NEEDED = ("starlette", "uvicorn")
"""Packages of the extra `app` that no other part of toppling needs."""
LOOPBACK = "127.0.0.1"


def live_page(
    study: Path | None = None,
    /,
    *,
    port: Annotated[int, Parameter(converter=whole)] = 0,
    browser: Annotated[bool, Parameter(negative="--no-browser")] = True,
) -> None:
    """Open a page on this machine that answers as you change a piece: its chance of falling, with its ranges.

    Nothing leaves this machine. It keeps its state in study files in the folder of STUDY, or in the current folder.

    Parameters
    ----------
    study
        Study file with one block or an inventory; default a bookcase.
    port
        Port of the page; default any free port.
    browser
        Open the page in a browser.
    """
    from ..text.error import StudyError  # noqa: PLC0415 - loads nothing before it is needed

    if any(find_spec(name) is None for name in NEEDED):
        raise StudyError("the live page needs further packages: pip install 'toppling[app]'")
    if not 0 <= port < 65536:
        raise StudyError(f"--port {port}: must be from 0 to 65535")
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    try:
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        bound.bind((LOOPBACK, port))
        bound.listen(128)  # (a browser that is faster than the page waits)
    except OSError as error:
        bound.close()
        raise StudyError(f"--port {port}: cannot be used ({error.strerror})") from None
    with bound:
        _serve(bound, study, opens=browser)


def _serve(bound: socket.socket, study: Path | None, *, opens: bool) -> None:
    def soon_open() -> threading.Timer:
        # (a browser starts while packages load and motions are made, unless a study is wrong)
        opening = threading.Timer(0.2, webbrowser.open, [address])
        if opens:
            opening.start()
        return opening

    token, port = secrets.token_urlsafe(24), bound.getsockname()[1]
    address = f"http://{LOOPBACK}:{port}/{token}/"
    if study is None:
        print(address, flush=True)
        opening = soon_open()
    import uvicorn  # noqa: PLC0415 - of the extra

    from ..file.include import read_content  # noqa: PLC0415
    from ..file.schema import StudyFile  # noqa: PLC0415
    from .building import Building  # noqa: PLC0415
    from .page import Page  # noqa: PLC0415
    from .server import application  # noqa: PLC0415
    from .state import BUILDING_STATE, PIECE_STATE  # noqa: PLC0415

    folder = Path.cwd() if study is None else study.parent
    full = study is not None and study.is_file() and "performance" in read_content(study, StudyFile).content
    if study is not None:
        address += "building" if full else ""
        opening = soon_open()
    wrong: list[Exception] = []

    def begin() -> None:
        try:
            page.piece  # noqa: B018 - makes the study
        except Exception as error:
            wrong.append(error)
            server.should_exit = True
            return
        where = f"The state of the page is in {building.path if full else page.path}; end the page with Ctrl-C."
        print(*([] if study is None else [address]), where, sep="\n", flush=True)
        page.begin()

    try:
        source = folder / PIECE_STATE if study is None or full else study
        page = Page.opened(source, given=source == study)
        building = Building.opened(study if study is not None and full else folder / BUILDING_STATE, given=full)
        app = application(page, token, port, building)
        settings = uvicorn.Config(app, log_level="critical", access_log=False, timeout_graceful_shutdown=1)
        server = uvicorn.Server(settings)
        threading.Thread(target=begin, daemon=True).start()
        with suppress(KeyboardInterrupt):  # (the usual end: the state is on the disk)
            server.run(sockets=[bound])
    finally:
        opening.cancel()
    if wrong:
        raise wrong[0]
