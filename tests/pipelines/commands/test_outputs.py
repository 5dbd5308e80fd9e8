"""No output of any command replaces what is read, a recording, or unasked another's file."""

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from inspect import Parameter, signature
from pathlib import Path
from typing import Any, get_args

import pytest
from typer.models import ArgumentInfo, CommandInfo, OptionInfo

from racecar.maps.map_files import load_map, save_map
from racecar.pipelines.commands.cli import app, commands_of, run
from racecar.pipelines.commands.outputs import Writes, WritesFolder, written_parameters
from racecar.pipelines.files.outputs import written_to
from tests.pipelines.bag_samples import as_sqlite, file_of, write_bag

READ = {
    *("bag", "batch", "check", "config", "continue_", "edits", "map", "plan", "reference"),
    *("relations", "run", "runs", "target", "trajectories"),
}
"""The parameters of all commands that name a path to read."""
REFUSED = (
    "is a recording, and none is ever replaced",
    "lies in the recording",
    "is read by this run and would be replaced",
    "was not written by",
    "which would be replaced: name another folder, or replace it with --replace",
    "is a file; name a folder",
    "is a folder; name a file",
    "is written as .png",
    "cannot be written as a single file",
)


@dataclass(frozen=True)
class Command:
    words: tuple[str, ...]
    info: CommandInfo

    def __str__(self) -> str:
        return " ".join(self.words)

    @property
    def parameters(self) -> dict[str, Parameter]:
        assert self.info.callback is not None
        return dict(signature(self.info.callback).parameters)

    @property
    def written(self) -> dict[str, Writes]:
        assert self.info.callback is not None
        return written_parameters(self.info.callback)

    @property
    def read(self) -> list[str]:
        return [
            name
            for name, parameter in self.parameters.items()
            if name not in self.written and Path in types_in(parameter.annotation)
        ]

    def words_with(self, values: dict[str, Path], *more: str) -> list[str]:
        """What is typed: these values, and something for whatever else must be given."""
        words = list(self.words)
        for name, parameter in self.parameters.items():
            if name not in values and parameter.default is not Parameter.empty:
                continue
            value = str(values.get(name, f"none-{name}"))
            for option in get_args(parameter.annotation):
                if isinstance(option, ArgumentInfo):
                    words.append(value)
                elif isinstance(option, OptionInfo):  # typer keeps the flag as the default
                    words += [str(option.default), value]
        return [*words, *more]


def types_in(annotation: Any) -> set[Any]:
    return {annotation}.union(*(types_in(each) for each in get_args(annotation) if not hasattr(each, "help")))


ALL = [Command(tuple(title.split()[1:]), info) for title, info in commands_of(app, "racecar")]
WRITING = [(command, name) for command in ALL for name in command.written]


def by_another(path: Path) -> Path:
    """The same recording without our mark."""
    file = path / "metadata.yaml" if path.is_dir() else path
    contents = file.read_bytes()
    assert b"racecar" in contents
    file.write_bytes(contents.replace(b"racecar", b"another"))
    return path


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("inputs")
    mcap = write_bag(folder / "mcap", 3)
    sqlite = as_sqlite(mcap, folder / "sqlite")
    shutil.copy(file_of(mcap), folder / "alone.mcap")
    shutil.copy(file_of(sqlite), folder / "alone.db3")
    texts = {
        "true.tum": "1 0 0 0 0 0 0 1\n2 1 0 0 0 0 0 1\n",
        "true.relations": "1 2 1 0 0 0 0 0\n",
        "config.yaml": "mapping: {}\n",
        "list.txt": "alone.mcap\n",
        "edits.yaml": "- wall: [[0, 0], [1, 0]]\n",
        "foreign.json": '{"name": "a package"}\n',
    }
    for name, text in texts.items():
        (folder / name).write_text(text)
    save_map(load_map("building"), folder / "lab.yaml")
    (folder / "run").mkdir()
    (folder / "run" / "session.npz").write_bytes(b"PK of a session")
    return {
        "ROS 1 bag": by_another(write_bag(folder / "drive.bag", 3)),
        "lone mcap": folder / "alone.mcap",
        "lone db3": folder / "alone.db3",
        "bag folder": by_another(mcap),
        "file of a bag folder": file_of(mcap),
        "metadata of a bag folder": mcap / "metadata.yaml",
        "sqlite folder": sqlite,
        "trajectory": folder / "true.tum",
        "relations": folder / "true.relations",
        "settings": folder / "config.yaml",
        "list": folder / "list.txt",
        "edits": folder / "edits.yaml",
        "JSON": folder / "foreign.json",
        "map": folder / "lab.yaml",
        "image": folder / "lab.pgm",
        "session": folder / "run" / "session.npz",
    }


def contents_of(path: Path) -> dict[Path, bytes]:
    return {each: each.read_bytes() for each in [path, *path.rglob("*")] if each.is_file()}


def refused(capsys: pytest.CaptureFixture[str], words: list[str]) -> str:
    """What is said; exactly one sentence about the place, and before anything is done."""
    assert run(words) == 2, words
    said = capsys.readouterr().err
    assert any(sentence in said for sentence in REFUSED), (words, said)
    assert said.count("\n") == 1
    return said


def test_every_path_is_known_to_be_read_or_written() -> None:
    """Whoever adds a path to a command says which it is."""
    assert {name for command in ALL for name in command.read} == READ
    assert len(WRITING) > 30
    assert {"json", "out", "plot", "memory"} == {name for _, name in WRITING}


@pytest.mark.parametrize(("command", "name"), WRITING, ids=str)
def test_no_output_replaces_an_input(
    command: Command, name: str, inputs: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    """What lies anywhere, and, even with --replace, what the same run reads, by whichever parameter."""
    for path in inputs.values():
        before = contents_of(path)
        refused(capsys, command.words_with({name: path}))
        for other in command.read:
            refused(capsys, command.words_with({name: path, other: path}, "--replace"))
        assert contents_of(path) == before


@pytest.mark.parametrize("link", [os.symlink, os.link])
@pytest.mark.parametrize("replace", [[], ["--replace"]])
def test_links_to_what_is_read_are_no_way_around(
    link: Callable[[Path, Path], None], replace: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag, tum = write_bag(tmp_path / "drive.bag", 3), tmp_path / "true.tum"
    tum.write_text("1 0 0 0 0 0 0 1\n")
    for target in (bag, tum):
        link(target, target.with_suffix(".png"))
    before = contents_of(tmp_path)
    refused(capsys, ["check", str(bag), "--json", str(bag.with_suffix(".png")), *replace])
    true = ["evaluate", str(tum), "--reference", str(tum)]
    for flag in ("--json", "--plot"):
        refused(capsys, [*true, flag, str(tum.with_suffix(".png")), *replace])
    assert contents_of(tmp_path) == before


def test_paths_that_are_written_differently_are_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "other").mkdir()
    (tmp_path / "true.tum").write_text("1 0 0 0 0 0 0 1\n")
    (tmp_path / "folder").symlink_to(tmp_path)
    write_bag(tmp_path / "drive", 3)
    monkeypatch.chdir(tmp_path / "other")
    for path in ("../true.tum", "../other/../true.tum", str(tmp_path / "folder" / "true.tum")):
        said = refused(
            capsys, ["evaluate", "none.tum", "--reference", "../true.tum", "--json", path, "--replace"]
        )
        assert "is read by this run" in said
    for path in ("../drive/", "../folder/drive/new.json", "../drive/deep/new.json"):
        assert "recording" in refused(capsys, ["localize", "../drive", "--map", "building", "--out", path])
    said = refused(capsys, ["evaluate", "../drive:/odom", "--reference", "a", "--json", "../drive/new.json"])
    assert "lies in the recording" in said


def test_the_image_of_a_map_is_read_with_it(
    inputs: dict[str, Path], capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["localize", "none.bag", "--map", str(inputs["map"]), "--out", "none"]
    said = refused(capsys, [*words, "--json", str(inputs["image"]), "--replace"])
    assert "is read by this run" in said


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("map a.bag --out run --json run/map.yaml", "run/map.yaml would be written twice"),
        ("map a.bag --out new --json new", "is written to as well"),
        ("map a.bag --out run --record --json run/record/a.json", "is written to as well"),
        ("map a.bag --out a/run --json a", "is written to as well"),
        ("evaluate a.tum --reference b.tum --json c.png --plot c.png", "is written to as well"),
        ("track run --json run/track.csv", "is written to as well"),
        ("check a.bag --json file/a.json", "file is a file: name another place"),
        ("map a.bag --out file/run", "file is a file: name another place"),
        ("map a.bag --out file", "file is a file; name a folder to write to"),
        ("check a.bag --json .", "is a folder; name a file to write to"),
        (
            "evaluate a.tum --reference b.tum --plot e.txt",
            "e.txt is written as .png: name a file that ends so",
        ),
        ("evaluate a.tum --reference b.tum --plot e", "e is written as .png"),
        ("simulate --map building --out a.mcap", "cannot be written as a single file"),
        ("simulate --map building --out a/metadata.yaml", "cannot be written as a single file"),
        (f"check a.bag --json {'x' * 300}.json", "name too long"),
    ],
)
def test_what_cannot_be_written_is_told_before_any_work(
    words: str,
    sentence: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Nothing that is to be read is even there."""
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    Path("run").mkdir()
    assert run(words.split()) == 2
    said = capsys.readouterr().err
    assert sentence in said
    assert said.count("\n") == 1


@pytest.mark.slow
def test_a_command_may_be_repeated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With the same outputs and --replace, in the order of a day's work; and each writes what is declared of
    it."""
    monkeypatch.chdir(tmp_path)
    write_bag(Path("drive.bag"), 40)
    day = [
        "simulate --map building --out simulated.bag --duration 1",
        "simulate --map building --out other --duration 1",
        "check drive.bag --json check.json",
        "map drive.bag --out run --record --png --svg --json map.json",
        "render run --out run --json render.json",
        "localize drive.bag --map building --out run/localized --initial-pose 0 0 0 --record --json l.json",
        "evaluate run/trajectory.tum --reference run/localized/trajectory.tum --plot run/e.png --json e.json",
    ]
    for words in day:
        for _ in range(2):
            assert run([*words.split(), "--quiet", "--replace"]) == 0, words
        command = next(command for command in ALL if command.words == (words.split()[0],))
        mark = command.written.get("out")
        if isinstance(mark, WritesFolder):
            flags = dict.fromkeys(command.parameters) | {"record": True, "png": True, "svg": True}
            out = Path(words.split("--out ")[1].split()[0])
            assert {name.rstrip("/") for name in written_to(out)} <= {*mark.names(flags)}


def test_results_of_a_run_are_not_those_of_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_bag(Path("drive.bag"), 40)
    assert run(["map", "drive.bag", "--out", "run", "--record", "--quiet"]) == 0
    before = contents_of(Path("run"))
    for words in (
        "localize drive.bag --map run --out run",
        "localize drive.bag --map run/map.yaml --out run --replace",
        "map drive.bag --out run",
        "merge run none --out run",
        "map run/record --out run --record --replace",
        "map run/record --continue run --out run --record",
        "localize run/record --map building --out run --record",
        "render run --out none --json run/report.json",
        "map drive.bag --out none --continue run --json run/report.json --replace",
        "evaluate run/trajectory.tum --reference a.tum --json run/report.json",
        "evaluate run/trajectory.tum --reference a.tum --plot run/map.png",
    ):
        refused(capsys, words.split())
    assert contents_of(Path("run")) == before
    assert run(["map", "none.bag", "--out", "run", "--continue", "run"]) == 2
    assert capsys.readouterr().err.startswith("none.bag ")  # the place is right, only the bag is missing


def test_a_map_of_others_is_replaced_only_when_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_bag(Path("drive.bag"), 40)
    save_map(load_map("building"), Path("maps/map.yaml"))
    Path("maps/notes.txt").write_text("mine")
    Path("figures.json").write_text("{}")
    words = ["map", "drive.bag", "--out", "maps", "--quiet"]
    theirs = contents_of(Path("maps"))
    assert "maps holds map.pgm (by another program) and map.yaml (by another" in refused(capsys, words)
    assert "--replace" in refused(capsys, [*words[:3], "new", "--json", "figures.json"])
    assert run([*words, "--json", "figures.json", "--replace"]) == 0
    assert run([*words, "--json", "figures.json", "--replace"]) == 0
    assert Path("maps/notes.txt").read_text() == "mine"
    for name in ("map.pgm", "map.yaml"):
        kept = Path("maps", name.replace(".", ".kept."))
        assert kept.read_bytes() == theirs[Path("maps", name)]
    assert not list(Path("maps").glob("*.kept-2*"))  # our own files are not kept
    by_another(write_bag(Path("others/record"), 3))
    assert "is a recording" in refused(capsys, [*words[:3], "others", "--record", "--replace"])


def keepout_edits(run: Path) -> None:
    (run / "edits.yaml").write_text("- keepout: [[0, 0], [1, 0], [1, 1]]\n")


def paint(picture: Path) -> bytes:
    """Change the last pixel, as in an image editor."""
    contents = bytearray(picture.read_bytes())
    contents[-1] = 255 - contents[-1]
    picture.write_bytes(contents)
    return bytes(contents)


def test_what_was_made_by_hand_is_named_before_it_is_replaced_and_kept_then(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_bag(Path("drive.bag"), 40)
    home = Path("run")
    again, render = (
        ["map", "drive.bag", "--out", "run", "--quiet"],
        ["render", "run", "--out", "run", "--quiet"],
    )
    assert run(again) == 0
    keepout_edits(home)
    assert run(render) == 0
    assert run(render) == 0  # what was made from a run replaces it unasked
    said = refused(capsys, again)
    assert "run holds the results of `racecar render` for drive.bag and its keepout mask, which" in said

    painted, mask = paint(home / "map.pgm"), paint(home / "keepout_mask.pgm")
    before = contents_of(home)
    said = refused(capsys, render)
    assert "run holds keepout_mask.pgm (by another program) and map.pgm (by another program), " in said
    assert "keepout mask" not in said
    said = refused(capsys, again)
    assert "for drive.bag, keepout_mask.pgm (by another program) and map.pgm (by another program)" in said
    assert contents_of(home) == before

    assert run([*again, "--replace"]) == 0
    assert not (home / "keepout_mask.pgm").exists()  # of a map that may have lain otherwise
    assert (home / "edits.yaml").read_bytes() == before[home / "edits.yaml"]
    assert (home / "map.kept.pgm").read_bytes() == painted != (home / "map.pgm").read_bytes()
    assert (home / "keepout_mask.kept.pgm").read_bytes() == mask
    assert "keepout_mask.pgm" not in json.loads((home / "report.json").read_text())["files"]
    assert run(render) == 0
    painted = paint(home / "map.pgm")
    assert run([*render, "--replace"]) == 0
    assert (home / "map.kept-2.pgm").read_bytes() == painted


def test_a_mask_that_was_drawn_elsewhere_is_no_leftover(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_bag(Path("drive.bag"), 40)
    assert run(["map", "drive.bag", "--out", "run", "--quiet"]) == 0
    shutil.copy("run/map.pgm", "run/speed_mask.pgm")
    said = refused(capsys, ["render", "run", "--out", "run"])
    assert "run holds speed_mask.pgm (by another program), which" in said


def test_streams_are_written_to(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bag = write_bag(tmp_path / "drive.bag", 3)
    assert run(["check", str(bag), "--quiet", "--json", "/dev/stdout"]) == 0
    assert capfd.readouterr().out.startswith('{\n  "command": "racecar check"')
