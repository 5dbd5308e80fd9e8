"""Who is let in to a page, and who is not."""

from collections.abc import Iterator
from contextlib import ExitStack, closing
from typing import Any

import pytest
from websockets.exceptions import InvalidStatus

from racecar.pipelines.studio.page import Page
from racecar.pipelines.studio.server.gate import LOOPBACK, MOST_PAGES
from tests.pipelines.studio.server.visitor import loaded, visiting


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with closing(Page("a page", 0)) as page:
        yield page


def refusal(page: Page, **options: Any) -> int:
    """The status with which a connection is refused."""
    with pytest.raises(InvalidStatus) as refused, visiting(page, **options):
        pass
    return int(refused.value.response.status_code)


def secret_of(page: Page) -> str:
    return page.address.split("/")[3]


@pytest.mark.parametrize("host", ["", "localhost:1234", f"{LOOPBACK}:1234"])
def test_whoever_knows_the_address_is_let_in_through_a_tunnel_too(page: Page, host: str) -> None:
    assert loaded(page.address, **({"Host": host} if host else {}))[0] == 200
    with visiting(page, host=host) as connection:
        assert connection.recv(5.0)


def test_an_address_is_good_without_its_last_stroke(page: Page) -> None:
    assert loaded(page.address[:-1])[0] == 200
    with visiting(page, path=secret_of(page)) as connection:
        assert connection.recv(5.0)


@pytest.mark.parametrize("host", ["attacker.example", "127.0.0.1.attacker.example", "10.0.0.7", "[::1", ""])
def test_a_foreign_host_is_turned_away(page: Page, host: str) -> None:
    named = f"{host}:{page.server.get_port()}"
    status, words = loaded(page.address, Host=named)
    assert (status, words) == (403, "Open the page by the whole address that racecar has printed.\n")
    if host:
        assert refusal(page, additional_headers={"Host": named}) in (400, 403, 500)


@pytest.mark.parametrize(
    "origin",
    [None, "null", "http://attacker.example", "http://127.0.0.1", "http://127.0.0.1:1", "https://{host}"],
)
def test_a_page_from_elsewhere_or_from_nowhere_is_turned_away(page: Page, origin: str | None) -> None:
    host = f"{LOOPBACK}:{page.server.get_port()}"
    said = None if origin is None else origin.format(host=host)
    assert refusal(page, origin=said) == 403
    if said is not None:
        assert loaded(page.address, Origin=said)[0] == 403


@pytest.mark.parametrize(
    "path", ["", "x", "{secret}x/", "{half}/", "x/{secret}/", "?{secret}", "%2e/{secret}/"]
)
def test_whoever_does_not_know_the_secret_is_turned_away(page: Page, path: str) -> None:
    secret = secret_of(page)
    tried = path.format(secret=secret, half=secret[:16])
    assert loaded(f"http://{LOOPBACK}:{page.server.get_port()}/{tried}")[0] == 403
    assert refusal(page, path=tried) == 403


def test_a_visitor_who_was_turned_away_is_told_nothing(page: Page) -> None:
    for answer in (loaded(page.address, Origin="null"), loaded(page.address[:-2])):
        assert secret_of(page) not in answer[1]


def test_of_200_pages_a_few_are_served_and_the_next_once_they_are_closed(page: Page) -> None:
    with ExitStack() as opened:
        refused = 0
        for _ in range(200):
            try:
                assert opened.enter_context(visiting(page)).recv(5.0)
            except InvalidStatus as error:
                assert error.response.status_code == 503
                refused += 1
        assert refused == 200 - MOST_PAGES
        assert loaded(page.address) == (503, f"{MOST_PAGES} pages are open already: close one.\n")
    with visiting(page) as connection:
        assert connection.recv(5.0)
    assert loaded(page.address)[0] == 200
