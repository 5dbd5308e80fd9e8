"""The page's script is changed on its way to the browser."""

import gzip
import re
from pathlib import Path
from typing import Any

import pytest
import viser
from websockets.datastructures import Headers
from websockets.http11 import Response

from racecar.pipelines.studio.server import changed_script
from racecar.pipelines.studio.server.changed_script import changing_script

PAGE = (Path(viser.__file__).parent / "client/build/index.html").read_bytes()
SENDER = "c.sendMessage!==null&&(i=s,n?(c.sendMessage(s),r=!1,n=!1,a=setTimeout(()=>0,t)):r=!0)"
"""As viser 1.1.1 has it."""


def served(body: bytes, **headers: str) -> Response:
    headers = {"Content-Length": str(len(body)), **headers}
    answer: Any = changing_script(lambda *_: Response(200, "OK", Headers(headers), body))
    response = answer(None, None)
    assert isinstance(response, Response)
    assert response.headers.get_all("Content-Length") == [str(len(response.body or b""))]
    return response


@pytest.mark.parametrize("is_packed", [False, True])
def test_the_page_of_this_viser_is_changed_in_one_place(is_packed: bool) -> None:
    if is_packed:
        body = gzip.decompress(served(gzip.compress(PAGE), **{"Content-Encoding": "gzip"}).body or b"")
    else:
        body = served(PAGE, **{"Content-Encoding": "identity"}).body or b""
    assert PAGE.count(b"e.textContent=code;") == 1
    assert body == PAGE.replace(changed_script._RUNS, changed_script._PATCHED) != PAGE


def test_other_answers_stay_as_they_are() -> None:
    assert served(b"e.textContent=another;").body == b"e.textContent=another;"
    assert changing_script(lambda *_: None)(None, None) is None  # type: ignore[arg-type]  # a socket


def test_the_sender_is_found() -> None:
    assert len(re.findall(changed_script._SENDER.strip("/"), SENDER)) == 1
