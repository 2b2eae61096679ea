"""The server of the live page: loopback only, a token in every address, bounded bodies, a sentence for each error."""

from __future__ import annotations

import asyncio
import hmac
import json
import sys
import threading
import traceback
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from ..inventory.reading import KIND
from ..text.error import StudyError
from .building import Building
from .page import Page
from .state import BUILDING_STATE, whole_number

STATIC = Path(__file__).parent / "static"
SCRIPTS = {f"{name}.js": "text/javascript; charset=utf-8" for name in ("shared", "app", "building")}
FILES = {"app.css": "text/css; charset=utf-8", **SCRIPTS, "icon.svg": "image/svg+xml"}
AT_ONCE = asyncio.Semaphore(40)
MOST_BYTES = 16_384
"""Most bytes of a request's body."""
HAZARD, MOST_OF_FILE = "/hazard", 1_000_000
"""The address that takes the file of a hazard curve, and its most bytes."""
DROP = "/building/drop"
"""The address that takes a table, which may have as many bytes as an inventory."""
HEADERS = {
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; "
        "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""Headers of every answer."""
OF_REPORT = {"Content-Security-Policy": "default-src 'none'; style-src 'unsafe-inline'; img-src data:"}
"""The same of a report, which has its styles and pictures in it, and no script."""
Handler = Callable[[Request], Awaitable[Response]]


class TooLargeError(Exception):
    """A body has more bytes than a request may have."""


class Guard:
    """Refuses what does not come from the page itself: other hosts and origins, other addresses, large bodies."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        self._app, self._token = app, token
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request, or refuse it with one sentence."""
        if scope["type"] != "http":
            return
        refused = self._refused(scope)
        if refused is not None:
            await refused(scope, receive, send)
            return
        inner = {**scope, "root_path": f"/{self._token}"}

        async def headed(message: Message) -> None:
            if message["type"] == "http.response.start":
                given = {key for key, _ in message["headers"]}
                named = [(key.lower().encode(), value.encode()) for key, value in HEADERS.items()]
                message["headers"] += [pair for pair in named if pair[0] not in given]
            await send(message)

        await self._app(inner, receive, headed)

    def _refused(self, scope: Scope) -> Response | None:
        headers = {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}
        host, origin = headers.get("host", ""), headers.get("origin")
        if host not in self._hosts:
            return sentence("This page is served on this machine alone.", 403)
        if origin is not None and origin not in {f"http://{name}" for name in self._hosts}:
            return sentence("This page takes requests from itself alone.", 403)
        begins = f"/{self._token}/".encode()
        if not hmac.compare_digest(scope["path"].encode("utf-8", "replace")[: len(begins)], begins):
            return sentence("The address needs the token that toppling app prints.", 403)
        most = {HAZARD: MOST_OF_FILE, DROP: KIND.most_bytes}.get("/" + scope["path"].split("/", 2)[-1], MOST_BYTES)
        if not headers.get("content-length", "0").isdecimal() or int(headers.get("content-length", "0")) > most:
            return sentence(f"A request may have at most {most:,} bytes.", 413)
        return None


def sentence(text: str, status: int) -> Response:
    """Return an answer of one sentence."""
    return PlainTextResponse(text, status, headers=HEADERS)


async def bytes_of(request: Request, most: int = MOST_BYTES) -> bytes:
    """Return the body of a request; TooLargeError if it has too many bytes."""
    content = bytearray()
    async for part in request.stream():
        content += part
        if len(content) > most:
            raise TooLargeError(f"A request may have at most {most:,} bytes.")
    return bytes(content)


async def body_of(request: Request) -> dict[str, Any]:
    """Return the JSON object of a request; StudyError if it is none, TooLargeError if it has too many bytes."""
    content = await bytes_of(request)
    try:
        values = json.loads(content)
    except (ValueError, RecursionError):
        values = None
    if not isinstance(values, dict) or not all(isinstance(value, str) for value in values.values()):
        raise StudyError("the request must be an object of JSON whose values are texts")
    return values


async def in_thread(function: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a function, computed in a thread; the end of the command does not wait for it."""
    future: Future[Any] = Future()

    def work() -> None:
        try:
            future.set_result(function(*arguments))
        except BaseException as error:
            future.set_exception(error)

    future.set_running_or_notify_cancel()
    async with AT_ONCE:
        threading.Thread(target=work, daemon=True).start()
        return await asyncio.wrap_future(future)


def application(page: Page, token: str, port: int, building: Building | None = None) -> ASGIApp:
    """Return the application that serves the pages of a piece and a building at a port of this machine."""
    full = building or Building.opened(page.path.with_name(BUILDING_STATE), given=False)

    async def whole(_: Request) -> Response:
        return Response(await in_thread(page.render, "page"), media_type="text/html")

    async def static(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in FILES:
            return sentence("There is no such page.", 404)
        return Response((STATIC / name).read_bytes(), media_type=FILES[name])

    async def parts(function: Callable[..., dict[str, str]], *arguments: Any) -> Response:
        return _answer({"parts": await in_thread(function, *arguments), "version": page.version})

    async def begin(_: Request) -> Response:
        return await parts(page.parts)

    async def change(request: Request) -> Response:
        asked = await body_of(request)
        return await parts(page.change, asked.get("path", ""), asked.get("value", ""))

    async def hazard(request: Request) -> Response:
        content = await bytes_of(request, MOST_OF_FILE)
        return await parts(page.take_hazard, request.query_params.get("name", ""), content)

    async def variant(request: Request) -> Response:
        return await parts(page.keep, (await body_of(request)).get("what", ""))

    async def complete(request: Request) -> Response:
        version = whole_number(request.query_params.get("version", ""), "version")
        made = await in_thread(page.complete, version, request.query_params.get("stage", "rest"))
        return _answer({"parts": made or {}, "version": version, "superseded": made is None})

    async def film(request: Request) -> Response:
        level, motion = (whole_number(request.query_params.get(name, ""), name) for name in ("level", "motion"))
        return _answer(await in_thread(page.film, level, motion))

    async def save(request: Request) -> Response:
        asked = await body_of(request)
        files = await in_thread(page.save, asked.get("name", ""))
        return _answer({"said": page.render("saved", files=[file.name for file in files], folder=files[0].parent)})

    async def study(request: Request) -> Response:
        return PlainTextResponse(page.text(request.path_params["name"]))

    async def python(request: Request) -> Response:
        return PlainTextResponse(page.python(request.path_params["name"]))

    async def building_page(_: Request) -> Response:
        return Response(await in_thread(full.render, "page"), media_type="text/html")

    async def building_state(request: Request) -> Response:
        version = whole_number(request.query_params.get("version", ""), "version")
        return _answer(await in_thread(full.answer, version))

    async def building_drop(request: Request) -> Response:
        if request.headers.get("content-type") != "application/octet-stream":
            raise StudyError("a table must be sent as application/octet-stream")
        content = await bytes_of(request, KIND.most_bytes)
        return _answer({"parts": await in_thread(full.drop, request.query_params.get("name", ""), content)})

    async def building_change(request: Request) -> Response:
        asked = await body_of(request)
        return _answer({"parts": await in_thread(full.change, asked.get("path", ""), asked.get("value", ""))})

    async def building_text(request: Request) -> Response:
        what, name = request.path_params["what"], request.path_params["name"]
        kind, headers = ("text/html", OF_REPORT) if what == "report" else ("text/plain", None)
        return Response(await in_thread(full.text, what, name), media_type=kind, headers=headers)

    routes = [
        ("/", whole, "GET"),
        ("/building", building_page, "GET"),
        ("/building/state", building_state, "GET"),
        (DROP, building_drop, "POST"),
        ("/building/change", building_change, "POST"),
        ("/building/{what}/{name}", building_text, "GET"),
        ("/static/{name}", static, "GET"),
        ("/begin", begin, "GET"),
        ("/change", change, "POST"),
        (HAZARD, hazard, "POST"),
        ("/variant", variant, "POST"),
        ("/complete", complete, "GET"),
        ("/film", film, "GET"),
        ("/save", save, "POST"),
        ("/study/{name}", study, "GET"),
        ("/python/{name}", python, "GET"),
    ]
    app = Starlette(
        routes=[Route(path, _one_sentence(handler), methods=[method]) for path, handler, method in routes],
        exception_handlers={HTTPException: _refuse},
    )
    return Guard(app, token, port)


def _answer(parts: dict[str, Any]) -> Response:
    content = json.dumps(parts, ensure_ascii=False, allow_nan=False).encode("utf-8", "replace")
    return Response(content, media_type="application/json")


def _one_sentence(handler: Handler) -> Handler:
    """Return a handler that answers what is wrong in a request with one sentence."""

    async def handled(request: Request) -> Response:
        try:
            return await handler(request)
        except StudyError as error:
            content = {"said": str(error), "path": getattr(error, "path", "")}
            return Response(json.dumps(content), 422, media_type="application/json")
        except TooLargeError as error:
            return sentence(str(error), 413)
        except ClientDisconnect:
            return sentence("The request ended early.", 400)
        except Exception as error:  # (an answer to a broken request fails later, which is no error of the page)
            traceback.print_exception(error, file=sys.stderr)
            return sentence("The request cannot be answered.", 500)

    return handled


async def _refuse(_: Request, error: Exception) -> Response:
    wrong_method = isinstance(error, HTTPException) and error.status_code == 405
    text = "This address does not take such a request." if wrong_method else "There is no such page."
    return sentence(text, 405 if wrong_method else 404)
