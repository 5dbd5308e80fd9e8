import json
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from racecar.pipelines.files.report import Report
from racecar.pipelines.files.run_report import RunReport, read_report

ANY_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=8,
)
PARTS = st.sampled_from(sorted(RunReport.model_fields))


def test_what_is_written_is_read(tmp_path: Path) -> None:
    report = Report("racecar map")
    report.add("inputs", {"bag": Path("drive.bag"), "continue": Path("earlier"), "seed": 3})
    report.add("accuracy", {"share_of_end_points_within_0.10_m_of_a_wall": 0.5})
    report.add("quality", {"verdict": "good", "error_per_10_m": float("nan"), "segments": []})
    report.warn("Beware.")
    report.write(tmp_path / "report.json")
    read = read_report(tmp_path)
    assert read.damage == ""
    assert (read.command, read.cautions) == ("racecar map", ["Beware."])
    assert (read.inputs.bag, read.inputs.continued) == ("drive.bag", "earlier")
    assert read.inputs.model_dump(exclude_unset=True)["seed"] == 3
    assert (read.accuracy.share_on_walls, read.quality.error_per_10_m) == (0.5, None)
    assert read.stages.total.wall_seconds is not None


def test_none_is_empty_and_no_fault(tmp_path: Path) -> None:
    assert read_report(tmp_path).cautions == []


@given(st.dictionaries(PARTS, ANY_JSON | st.dictionaries(st.sampled_from(["bag", "segments"]), ANY_JSON)))
def test_of_any_shape_it_is_read(tmp_path_factory, contents) -> None:
    folder = tmp_path_factory.mktemp("run")
    (folder / "report.json").write_text(json.dumps(contents))
    report = read_report(folder)
    assert report.damage == "" or report.damage.endswith((".", "used."))
    report.named_map()
    json.dumps(report.model_dump()).encode()
