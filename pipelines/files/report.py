"""report.json: the input, output and cost of a run."""

import json
import os
import platform
import resource
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import PackageNotFoundError, version
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from racecar.maps.whole_files import write_atomically
from racecar.pipelines.files.run_report import RunReport

_REPORTED_PACKAGES = ("racecar-slam", "numpy", "numba", "scipy", "gtsam", "kiss-icp", "rosbags", "evo")


class Report:
    """Collects a run's figures by section."""

    def __init__(self, command: str) -> None:
        self._started_wall = time.perf_counter()
        self._started_cpu = time.process_time()
        self._sections: dict[str, Any] = {"command": command}
        self._stages: dict[str, dict[str, float]] = {}
        self._warnings: list[str] = []

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Measure the wall and CPU seconds (all threads) of the block; repeated names add up."""
        wall, cpu = time.perf_counter(), time.process_time()
        try:
            yield
        finally:
            spent = self._stages.setdefault(name, {"wall_seconds": 0.0, "cpu_seconds": 0.0})
            spent["wall_seconds"] += time.perf_counter() - wall
            spent["cpu_seconds"] += time.process_time() - cpu

    def add(self, section: str, values: Mapping[str, Any]) -> None:
        """Add numbers, strings, paths, arrays, or nested combinations of them, to a section."""
        self._sections.setdefault(section, {}).update(values)

    def warn(self, sentence: str) -> None:
        """Add a warning for the user."""
        self._warnings.append(sentence)

    @property
    def warnings(self) -> list[str]:
        """The warnings so far."""
        return list(self._warnings)

    @property
    def seconds(self) -> float:
        """Seconds since the start of the run."""
        return time.perf_counter() - self._started_wall

    @property
    def contents(self) -> RunReport:
        """Everything so far, as read back from the file."""
        return RunReport.model_validate(self.as_dict())

    def as_dict(self) -> dict[str, Any]:
        """Everything so far, in JSON types; non-finite numbers become None."""
        total = {
            "wall_seconds": self.seconds,
            "cpu_seconds": time.process_time() - self._started_cpu,
        }
        contents: dict[str, Any] = _plain(
            {
                **self._sections,
                "warnings": self._warnings,
                "stages": {**self._stages, "total": total},
                "peak_memory_mb": peak_memory_mb(),
                "versions": _versions(),
                "machine": {"system": platform.platform(), "cpus": os.cpu_count()},
            }
        )
        return contents

    def write(self, path: Path) -> None:
        """Write the report as JSON. Raises UserError when the file cannot be written."""
        write_json(path, self.as_dict())


def write_json(path: Path, contents: Mapping[str, Any]) -> None:
    """Write figures as JSON, complete or not at all. Raises UserError when the file cannot be written."""
    text = json.dumps(_plain(contents), indent=2, ensure_ascii=False, allow_nan=False)
    with write_atomically(path) as partial:
        partial.write_text(text + "\n", encoding="utf-8", errors="replace")  # a path may not be valid text


def peak_memory_mb() -> float:
    """Peak resident memory of this process so far, in megabytes."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    bytes_per_unit = 1 if sys.platform == "darwin" else 1024
    return peak * bytes_per_unit / 1e6


def resident_memory_mb(process: int | None = None) -> float:
    """Current resident memory of a process, or of this one, in megabytes; nan if unknown."""
    pages = Path(f"/proc/{process or 'self'}/statm")
    return (
        int(pages.read_text().split()[1]) * resource.getpagesize() / 1e6 if pages.exists() else float("nan")
    )


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for package in _REPORTED_PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            versions[package] = "not installed"
    return versions


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return _plain(value.tolist())
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not isfinite(value):
        return None
    return value
