"""Requests to the application of the live page without a server."""

import asyncio
import json

TOKEN, PORT = "t0ken", 8000
HOST = f"127.0.0.1:{PORT}"


def ask(app, path, body=None, method=None, headers=(), query=b"", host=HOST, length=True):
    """Return status, headers and text of an answer."""
    body = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
    method = method or ("GET" if body is None else "POST")
    named = [(b"host", host.encode()), *headers]
    if body is not None and length:
        named.append((b"content-length", str(len(body)).encode()))
    scope = {
        "type": "http",
        "asgi": {"version": "3.0"},
        "http_version": "1.1",
        "method": method,
        "scheme": "http",
        "path": path,
        "raw_path": path.encode("utf-8", "replace"),
        "root_path": "",
        "query_string": query,
        "headers": named,
        "server": ("127.0.0.1", PORT),
        "client": ("127.0.0.1", 1),
    }
    parts = [{"type": "http.request", "body": body or b"", "more_body": False}]
    sent = []

    async def receive():
        return parts.pop(0) if parts else {"type": "http.disconnect"}

    async def send(message):
        sent.append(message)

    asyncio.run(app(scope, receive, send))
    found = {key.decode(): value.decode() for key, value in sent[0]["headers"]}
    return sent[0]["status"], found, b"".join(message.get("body", b"") for message in sent[1:]).decode()
