"""Where pages look, whatever their browsers report."""

from collections.abc import Coroutine
from contextlib import suppress
from types import SimpleNamespace
from typing import Any
from unittest.mock import MagicMock

import numpy as np
import pytest

from racecar.pipelines.studio import top_view
from racecar.pipelines.studio.top_view import FIELD_OF_VIEW, TopView

LOW, HIGH = np.array([0.0, 0.0]), np.array([40.0, 20.0])
FIRST_VIEW = (3.0, 3.0, 3.0), (0.0, 0.0, 0.0)
"""Place of the camera and what it looks at, as a browser has it before it is shown anything."""


@pytest.fixture
def view(monkeypatch: pytest.MonkeyPatch) -> TopView:
    monkeypatch.setattr(top_view, "_OBEYED_AFTER", -1.0)
    server = MagicMock()
    server.get_clients.return_value = {}
    server.initial_camera = SimpleNamespace()
    view = TopView(server, lambda *_: False)
    view.show_whole(LOW, HIGH)
    return view


def finish(handler: Coroutine[Any, Any, None]) -> None:
    """Of what waits for nothing; a loop of events would be in the way of the browser's, which may run."""
    with suppress(StopIteration):
        handler.send(None)


def a_page(view: TopView) -> Any:
    """The camera of a page that has just come."""
    client = MagicMock(client_id=7)
    camera = client.camera = SimpleNamespace(
        fov=FIELD_OF_VIEW, client=client, on_update=lambda _: None, aspect=1.5, image_height=600
    )
    finish(view._meet(client))
    return camera


def report(view: TopView, camera: Any, position: Any, look_at: Any) -> None:
    """The browser says where it looks from."""
    camera.position, camera.look_at = position, look_at
    finish(view._keep_upright(camera))


def test_a_late_report_of_the_first_view_does_not_lead_away_from_the_map(view: TopView) -> None:
    camera = a_page(view)
    height = camera.position[2]
    report(view, camera, *FIRST_VIEW)
    np.testing.assert_allclose(camera.position, [20.0, 10.0, height])
    np.testing.assert_allclose(camera.look_at, [20.0, 10.0, 0.0])


def test_a_tilted_view_goes_back_to_where_it_was_moved_and_zoomed(view: TopView) -> None:
    camera = a_page(view)
    report(view, camera, (5.0, 6.0, 30.0), (5.0, 6.0, 0.0))
    assert camera.position == (5.0, 6.0, 30.0)
    report(view, camera, (9.0, 9.0, 25.0), (5.0, 6.0, 0.0))
    np.testing.assert_allclose(camera.position, [5.0, 6.0, 30.0])


def test_what_was_seen_before_a_page_was_told_to_look_elsewhere_does_not_count(
    view: TopView, monkeypatch: pytest.MonkeyPatch
) -> None:
    camera = a_page(view)
    monkeypatch.setattr(top_view, "_OBEYED_AFTER", 60.0)
    report(view, camera, (5.0, 6.0, 30.0), (5.0, 6.0, 0.0))
    report(view, camera, (9.0, 9.0, 25.0), (5.0, 6.0, 0.0))
    np.testing.assert_allclose(camera.position[:2], [20.0, 10.0])


def test_a_map_that_grows_stays_in_view_unless_a_person_looks_elsewhere(view: TopView) -> None:
    camera = a_page(view)
    view._server.get_clients.return_value = {7: camera.client}
    before = camera.position[2]
    view.keep_whole((LOW, HIGH))
    assert camera.position[2] == before
    view.keep_whole((LOW, 2.0 * HIGH))
    np.testing.assert_allclose(camera.position[:2], [40.0, 20.0])
    assert camera.position[2] > 1.9 * before
    report(view, camera, (5.0, 6.0, 30.0), (5.0, 6.0, 0.0))
    view.keep_whole((LOW, 8.0 * HIGH))
    assert camera.position == (5.0, 6.0, 30.0)


def test_the_whole_fits_a_page_whatever_its_size_unless_a_person_looks_elsewhere(view: TopView) -> None:
    camera = a_page(view)
    wide = camera.position[2]
    camera.aspect = 0.75
    report(view, camera, camera.position, camera.look_at)
    narrow = camera.position[2]
    assert narrow == pytest.approx(2.0 * wide)
    report(view, camera, (5.0, 6.0, 30.0), (5.0, 6.0, 0.0))
    camera.aspect = 1.5
    report(view, camera, (5.0, 6.0, 30.0), (5.0, 6.0, 0.0))
    assert camera.position == (5.0, 6.0, 30.0)


def test_a_pixel_is_as_wide_as_the_most_zoomed_in_page_shows_it(view: TopView) -> None:
    camera = a_page(view)
    view._server.get_clients.return_value = {7: camera.client}
    report(view, camera, (5.0, 6.0, 30.0), (5.0, 6.0, 0.0))
    assert view.pixel == pytest.approx(2.0 * 30.0 * np.tan(FIELD_OF_VIEW / 2.0) / 600)
