"""Which of a bag's topics are the scans and which the odometry."""

from collections.abc import Mapping, Sequence
from difflib import get_close_matches

from racecar.maps.errors import UserError
from racecar.pipelines.bags.findings import Finding
from racecar.pipelines.bags.storage.chunks import BagTopic

NOT_WHEELS = ("ground_truth", "groundtruth", "/pf/", "amcl")
"""Parts of names of odometry topics that carry a solution or the truth instead of dead reckoning."""


def choose_topic(
    topics: Mapping[str, BagTopic],
    types: Sequence[str],
    named: str | None,
    purpose: str,
    flag: str,
    findings: list[Finding],
) -> BagTopic | None:
    """The named topic, or else the one of the first type present with most messages; None without any.

    Where several might be meant, the choice goes into ``findings``.
    Raises UserError when the named topic is not in the bag or of another type.
    """
    if named is not None:
        return _named_topic(topics, types, named, purpose)
    for message_type in types:
        found = [
            topic for topic in topics.values() if topic.message_type == message_type and topic.message_count
        ]
        found = [topic for topic in found if not _is_no_wheel_odometry(topic)] or found
        found.sort(key=lambda topic: (-topic.message_count, topic.name))
        if len(found) > 1:
            others = ", ".join(topic.name for topic in found[1:])
            what = f"{purpose} are taken from {found[0].name}, not from {others}."
            findings.append(Finding(what, f"Choose another with {flag}, if this is not the one."))
        if found:
            return found[0]
    return None


def _named_topic(topics: Mapping[str, BagTopic], types: Sequence[str], named: str, purpose: str) -> BagTopic:
    topic = topics.get(named) or topics.get("/" + named)
    if topic is None:
        close = get_close_matches(named, topics, n=1, cutoff=0.5)
        hint = f" (did you mean {close[0]}?)" if close else ""
        raise UserError(f"there is no topic {named} in the bag{hint}; its topics are {list_topics(topics)}.")
    if topic.message_type not in types:
        usable = ", ".join(topic.name for topic in topics.values() if topic.message_type in types) or "none"
        raise UserError(
            f"topic {topic.name} holds {topic.message_type}, not {purpose.lower()}; topics that do: {usable}."
        )
    return topic


def _is_no_wheel_odometry(topic: BagTopic) -> bool:
    return any(part in topic.name.lower() for part in NOT_WHEELS)


def list_topics(topics: Mapping[str, BagTopic]) -> str:
    """All topics with their types, for people."""
    return ", ".join(f"{topic.name} ({topic.message_type})" for topic in topics.values()) or "none"
