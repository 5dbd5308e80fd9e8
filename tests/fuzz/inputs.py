"""Inputs by number: the same number gives the same input."""

import random
import tempfile
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from tests.fuzz.mutations import damage, odd_message
from tests.fuzz.samples import SECONDS, Sample, bag_action, healthy_samples, write_drive

COMMANDS = (*SECONDS, "page")
_ODD_MESSAGES_SHARE = 0.3
"""Of the inputs: sound bags with odd messages in them, since damage to bytes seldom makes such."""


@dataclass(frozen=True)
class Input:
    """A damaged input."""

    number: int
    sample: Sample
    what: str
    """Was done to it."""


class Inputs:
    """Makes inputs of healthy samples."""

    def __init__(self, commands: tuple[str, ...] = COMMANDS, words: tuple[str, ...] = ()) -> None:
        """Of the ``commands`` that read bags; with ``words``, only of samples whose names hold one."""
        with tempfile.TemporaryDirectory() as folder:
            samples = healthy_samples(Path(folder))
        self.healthy = samples
        self._has_odd_messages = not words
        self._samples = [
            sample
            for sample in samples
            if sample.damaged
            and sample.command in (*commands, "")
            and (not words or any(word in sample.name for word in words))
        ]
        self._commands = [command for command in commands if command in SECONDS]
        self._room = next(sample.files for sample in samples if sample.command == "localize")

    def make(self, number: int) -> Input:
        """The input of a number."""
        rng = random.Random(number)
        if self._has_odd_messages and rng.random() < _ODD_MESSAGES_SHARE:
            return self._odd_messages(number, rng)
        (sample,) = rng.choices(self._samples, [sample.weight for sample in self._samples])
        name = rng.choice(sample.damaged)
        original = sample.files[name]
        assert isinstance(original, bytes)
        content, what = damage(name, original, rng)
        files = {**sample.files, name: content}
        return Input(number, replace(sample, files=files), f"{name}: {what}")

    def _odd_messages(self, number: int, rng: random.Random) -> Input:
        is_ros1, as_cloud = rng.random() < 0.3, rng.random() < 0.3
        (command,) = rng.choices(self._commands, [1.0, 0.03, 0.03][: len(self._commands)])
        topics = rng.sample(
            ("/scan" if not as_cloud else "/points", "/odom", "/tf", "/tf_static"), rng.choice((1, 1, 2))
        )
        share, same = rng.choice((0.02, 0.2, 1.0)), rng.randrange(1 << 32) if rng.random() < 0.6 else None

        def change(topic: str, message: Any) -> Any:
            if topic not in topics or rng.random() > share:
                return message
            return _serializable(message, random.Random(same) if same is not None else rng, is_ros1)

        with tempfile.TemporaryDirectory() as folder:
            bag = Path(folder) / ("drive.bag" if is_ros1 else "drive")
            write_drive(bag, change, as_cloud)
            paths = [bag] if is_ros1 else sorted(bag.iterdir())
            files = {str(path.relative_to(folder)): path.read_bytes() for path in paths}
        if command == "localize":
            files |= {name: content for name, content in self._room.items() if name.startswith("room")}
        action = partial(bag_action, command, bag.name)
        sample = Sample("odd messages", files, action, (), command, seconds=SECONDS[command])
        return Input(number, sample, f"{share:.0%} of {', '.join(topics)}")


def _serializable(message: Any, rng: random.Random, is_ros1: bool) -> Any:
    """An odd message whose numbers fit into their fields."""
    from racecar.pipelines.bags.messages import ros1_types, ros2_types

    for _ in range(20):
        odd = odd_message(message, rng)
        try:
            if is_ros1:
                ros1_types().serialize_ros1(odd, odd.__msgtype__)
            else:
                ros2_types().serialize_cdr(odd, odd.__msgtype__)
        except Exception:  # whatever numbers too large for their fields raise
            continue
        return odd
    return message
