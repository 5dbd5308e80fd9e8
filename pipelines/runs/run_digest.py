"""What decides how a map comes out, as a digest by which runs are compared."""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

from racecar.pipelines.files.config_file import Config
from racecar.pipelines.runs.bag_reading import BagReading


def run_digest(
    bag_fingerprint: str,
    config: Config,
    reading: BagReading,
    continued: Path | None,
    initial_pose: Sequence[float] | None,
) -> str:
    """Changes whenever a bag with this fingerprint would result in a different map."""
    decisive = {
        "bag": bag_fingerprint,
        "settings": config.mapping.model_dump(mode="json"),
        "sensors": config.sensors.model_dump(mode="json"),
        "reading": asdict(reading),
        "continued": None if continued is None else str(continued),
        "initial_pose": None if initial_pose is None else [float(number) for number in initial_pose],
    }
    return hashlib.sha256(json.dumps(decisive, sort_keys=True).encode()).hexdigest()
