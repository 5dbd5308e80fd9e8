"""When a job is done, and what makes it another."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from racecar.pipelines.files.config_file import load_config
from racecar.pipelines.runs.bag_reading import BagReading
from racecar.pipelines.runs.mapping_job import MappingJob, carry_out, is_done
from racecar.pipelines.runs.run_context import RunContext
from tests.pipelines.bag_samples import write_bag


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> MappingJob:
    folder = tmp_path_factory.mktemp("job")
    job = MappingJob(write_bag(folder / "drive.bag"), folder / "out", load_config(None))
    assert not is_done(job)
    carry_out(job, RunContext())
    return job


def test_a_job_is_done_once(done: MappingJob) -> None:
    assert is_done(done)


def test_other_settings_another_reading_or_more_files_are_another_job(done: MappingJob) -> None:
    coarse = load_config({"mapping": {"resolution": 0.1}})
    assert not is_done(replace(done, config=coarse))
    assert not is_done(replace(done, reading=BagReading(duration=3.0)))
    assert not is_done(replace(done, reading=BagReading(laser_pose=(0.1, 0.0, 0.0))))
    assert not is_done(replace(done, requested=("map_image.png",)))
    assert not is_done(replace(done, record=True))


def test_settings_of_the_localizer_are_the_same_job(done: MappingJob) -> None:
    assert is_done(replace(done, config=load_config({"localization": {"particles": 1000}})))


def test_a_changed_bag_is_another_job_and_a_copy_the_same(done: MappingJob, tmp_path: Path) -> None:
    assert not is_done(replace(done, bag=write_bag(tmp_path / "other.bag", 150)))
    (tmp_path / "copy.bag").write_bytes(done.bag.read_bytes())
    assert is_done(replace(done, bag=tmp_path / "copy.bag"))
    assert not is_done(replace(done, bag=tmp_path / "missing.bag"))


def test_a_cut_or_interrupted_run_is_not_done(done: MappingJob, tmp_path: Path) -> None:
    for name in ("report.json", "map.yaml", "session.npz"):
        moved = done.out / name
        moved.rename(tmp_path / name)
        assert not is_done(done), name
        (tmp_path / name).rename(moved)
    whole = (done.out / "report.json").read_text()
    interrupted = json.loads(whole)
    interrupted["counts"]["interrupted"] = True
    (done.out / "report.json").write_text(json.dumps(interrupted))
    assert not is_done(done)
    (done.out / "report.json").write_text(whole)
    assert is_done(done)
