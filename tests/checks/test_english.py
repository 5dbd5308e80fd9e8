"""What users read is plain English: the phrases that were found odd once do not come back."""

import pytest

from tests.checks.english import PHRASES, REPOSITORY, Text, odd_phrases, texts

ALL = list(texts())


def _where(text: Text) -> str:
    return f"{text.path.relative_to(REPOSITORY)}:{text.line}"


def test_no_odd_phrase_comes_back() -> None:
    found = {_where(text): odd for text in ALL if (odd := odd_phrases(text.words))}
    assert found == {}


def test_everything_that_users_read_is_looked_at() -> None:
    read = {str(text.path.relative_to(REPOSITORY)) for text in ALL}
    assert {"README.md", "docs/how-to/troubleshooting.md", "pipelines/live/share/localizer.yaml"} <= read
    words = " ".join(" ".join(text.words.split()) for text in ALL)
    assert "There is not enough memory for this" in words  # an error
    assert "Estimate where the car was on a map" in words  # help
    assert "a new keyframe is due after this turn" in words.lower()  # a setting


@pytest.mark.parametrize(
    ("sentence", "odd"),
    [
        ("Without odometry nothing tells the motion.", ["nothing tells"]),
        ("The laser is told as unknown.", ["is told"]),
        ("Of the jump no way is made.", ["no way is"]),
        ("how fast it follows and how\n    calm it then is", ["how calm"]),
        ("See that only one node publishes it.", ["See that"]),
        ("Make sure that only one node publishes it.", []),
        ("Enough to see that everything works.", []),
    ],
)
def test_odd_phrases_are_recognized(sentence: str, odd: list[str]) -> None:
    assert odd_phrases(sentence) == odd
    assert len(PHRASES) >= 40
