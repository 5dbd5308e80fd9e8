"""Words for what a damaged bag has lost."""

from collections.abc import Sequence

from racecar.pipelines.bags.storage.chunks import Damage


def describe_losses(
    damages: Sequence[Damage], messages_read: int, messages_expected: int | None
) -> list[str]:
    """Sentences about what is lost; ``messages_expected`` is None where it is not known."""
    if not damages:
        return []
    if messages_expected:
        share = f" of {messages_expected} messages ({messages_read / messages_expected:.0%})"
    else:
        share = " messages"
    *others, last = (_describe(damage) for damage in damages)
    return [*others, f"{last} {messages_read}{share} of the bag could be read."]


def _describe(damage: Damage) -> str:
    read = damage.bytes_read / 1e6
    if damage.bytes_expected is None:
        return f"{damage.file_name} {damage.cause}, after {read:.1f} MB; how much is missing is not known."
    if damage.bytes_read >= damage.bytes_expected:
        return f"{damage.file_name} {damage.cause}."
    lost, expected = 1 - damage.bytes_read / damage.bytes_expected, damage.bytes_expected / 1e6
    return (
        f"{damage.file_name} {damage.cause}: {lost:.0%} of its bytes are lost "
        f"({read:.1f} of {expected:.1f} MB could be read)."
    )
