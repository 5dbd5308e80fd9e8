"""Change viser's script on its way to the browser, in two places.

It sends one message in 20 ms for clicks on the floor, one in 50 ms for the side panel, and of several the
last one only. A busy page handles several clicks at once, and would lose all but two. Changed, only a newer
value of a control replaces one that waits.

It draws images as if they were transparent, which takes a browser that draws in software most of the time of
a frame. Changed, they are opaque, as a map is; their shader then has to be told when their texture has come.
"""

import gzip
from collections.abc import Callable
from functools import cache
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

Answer = Callable[[ServerConnection, Request], Any]

_RUNS = b"e.textContent=code;"
"""Where the page that viser serves runs its unpacked script."""
_SENDER = r"/(\w+)\.sendMessage!==null&&\((\w+)=(\w+),(\w+)\?\(\1\.sendMessage\(\3\),(\w+)=!1,/"
"""The function that sends a message $3 with $1 at once if it is ready ($4), or else keeps it as $2, which the
flag $5 says. The names differ from build to build."""
_SENDS_ALL = (
    "$1.sendMessage!==null&&("
    "$5&&$2&&$2!==$3&&"
    "($2.type!==$3.type||$2.uuid!==$3.uuid||$3.type===`ScenePointerMessage`||$3.updates?.value===!0)"
    "&&($1.sendMessage($2),$5=!1),"
    "$2=$3,$4?($1.sendMessage($3),$5=!1,"
)
"""The same, but it first sends the message that is kept, unless the new one is a newer value of the same
control. A pressed button has the value true."""
_TRANSPARENT = r"/transparent:!0,side:2,map:(\w+),/g"
"""How it draws an image with a texture $1, which is missing until it is unpacked."""
_OPAQUE = "transparent:!1,side:2,map:$1,needsUpdate:!!$1,"
_PATCHED = (
    f"e.textContent=code.replace({_SENDER},'{_SENDS_ALL}').replace({_TRANSPARENT},'{_OPAQUE}');".encode()
)


def changing_script(answer: Answer) -> Answer:
    """Wrap what ``answer`` serves."""

    def answer_changed(connection: ServerConnection, request: Request) -> Any:
        response = answer(connection, request)
        if not isinstance(response, Response) or not response.body:
            return response
        is_packed = response.headers.get("Content-Encoding") == "gzip"
        body = _changed(bytes(response.body), is_packed=is_packed)
        headers = Headers(response.headers)
        del headers["Content-Length"]
        headers["Content-Length"] = str(len(body))
        return Response(response.status_code, response.reason_phrase, headers, body)

    return answer_changed


@cache
def _changed(body: bytes, *, is_packed: bool) -> bytes:
    page = gzip.decompress(body) if is_packed else body
    page = page.replace(_RUNS, _PATCHED)
    return gzip.compress(page) if is_packed else page
