import json
import time
from pathlib import Path

import numpy as np
import pytest

from racecar.pipelines.files.report import Report, write_json


def test_report_holds_what_was_added(tmp_path: Path) -> None:
    report = Report("racecar map")
    report.add("inputs", {"bag": Path("drive.bag"), "base_from_laser": np.zeros(3)})
    report.add("inputs", {"scan_topic": "/scan"})
    report.add("accuracy", {"mean": np.float32(0.5), "spread": float("nan"), "count": np.int64(3)})
    report.warn("The bag is cut.")
    report.write(tmp_path / "report.json")

    written = json.loads((tmp_path / "report.json").read_text())
    assert written["command"] == "racecar map"
    assert written["inputs"] == {
        "bag": "drive.bag",
        "base_from_laser": [0.0, 0.0, 0.0],
        "scan_topic": "/scan",
    }
    assert written["accuracy"] == {"mean": 0.5, "spread": None, "count": 3}
    assert written["warnings"] == ["The bag is cut."]
    assert written["versions"]["numpy"] == np.__version__
    assert written["peak_memory_mb"] > 10


def test_stages_add_up_even_when_they_fail() -> None:
    report = Report("racecar map")
    with report.stage("reading"):
        time.sleep(0.01)
    with pytest.raises(ValueError), report.stage("reading"):
        time.sleep(0.01)
        raise ValueError
    stages = report.as_dict()["stages"]
    assert 0.02 <= stages["reading"]["wall_seconds"] <= stages["total"]["wall_seconds"]
    assert stages["reading"]["cpu_seconds"] < 0.02


def test_json_is_strict(tmp_path: Path) -> None:
    write_json(tmp_path / "figures.json", {"a": [np.inf, 1.0], "b": {"c": (1, "é")}})
    assert json.loads((tmp_path / "figures.json").read_text()) == {"a": [None, 1.0], "b": {"c": [1, "é"]}}
