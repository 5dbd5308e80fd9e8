"""What users and developers read is plain English: phrases that were found odd once do not come back."""

import pytest

from tests.checks.english import PHRASES, PHRASES_OF_CODE, REPOSITORY, Text, odd_phrases, remarks, texts

ALL = list(texts())


def _where(text: Text) -> str:
    return f"{text.path.relative_to(REPOSITORY)}:{text.line}"


def test_no_odd_phrase_comes_back() -> None:
    found = {_where(text): odd for text in ALL if (odd := odd_phrases(text.words))}
    assert found == {}


def test_no_odd_phrase_comes_back_into_docstrings_and_comments() -> None:
    found = {_where(text): odd for text in remarks() if (odd := odd_phrases(text.words, in_code=True))}
    assert found == {}


def test_docstrings_and_comments_are_looked_at() -> None:
    words = [" ".join(text.words.split()) for text in remarks()]
    assert any(text.startswith("The mapper: one scan at a time") for text in words)  # a module
    assert "Number of rows." in words  # a field
    assert "# both are misses" in words  # a comment


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


@pytest.mark.parametrize(
    ("docstring", "odd"),
    [
        ("Of a drive so far.", ["Of"]),
        ("Metres of a cell; by judgement: twice what is fixed.", ["by judgement"]),
        ("Metres of a cell. Chosen by judgement: twice the tolerance.", []),
        (
            "At most so many keyframes, from which on\n    it is sought.",
            ["so many", "from which on", "sought"],
        ),
        ("Returns that the other scan looks through.", ["looks through"]),
        ("Returns that the other scan sees through.", []),
    ],
)
def test_odd_phrases_are_recognized_in_docstrings(docstring: str, odd: list[str]) -> None:
    assert odd_phrases(docstring, in_code=True) == odd
    assert len(PHRASES_OF_CODE) >= 20
