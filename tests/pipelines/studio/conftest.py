"""One Chromium for all tests of the studio, since each takes seconds to start."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.pipelines.studio.chromium import browser


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    with browser() as started:
        yield started
