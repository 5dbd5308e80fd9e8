"""Commands that are killed while they replace an earlier run, and the folder as it is read afterwards.

The rule: whoever reads the folder sees the earlier run or the new one, and other programs see files of one of
them only meanwhile. The same command then works as ever, and leaves nothing but its files.
"""

import atexit
import hashlib
import json
import os
import random
import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory, gettempdir, mkdtemp

from racecar.mapping import Mapper, MappingConfig
from racecar.maps.map_files import load_map
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.bags.replay import feed
from racecar.pipelines.commands.cli import run
from racecar.pipelines.files.config_file import Config
from racecar.pipelines.files.edits_file import edits_beside
from racecar.pipelines.files.run_report import read_report
from racecar.pipelines.files.session_file import load_session
from racecar.pipelines.files.tum import load_tum
from racecar.pipelines.live.saving.map_saving import MapOutput
from racecar.pipelines.runs.view.run_folder import load_run
from racecar.pipelines.simulation.simulator import Simulation, write_bag
from racecar.pipelines.simulation.simulator_config import SimulationConfig
from tests.killed import calls_of, in_fork, killed_after, killed_at

INPUTS = {
    "coarse.yaml": "mapping: {resolution: 0.1}\n",
    "edits.yaml": "- wall: [[0, 0], [1, 1]]\n- keepout: [[0, 0], [1, 0], [1, 1]]\n",
    "out/fewer.yaml": "- wall: [[0, 0], [1, 1]]\n",
    "out/notes.txt": "mine\n",
}
_VOLATILE = ("stages", "peak_memory_mb", "mapping_seconds", "update_ms")
"""Of report.json: what differs from run to run."""
_HOME = re.compile(rf'{re.escape(gettempdir())}/[^/"]+(/home)?')
"""A working directory, which the reports of a batch name."""
_AT_A_CALL = 0.7
"""Share of the kills; the others come at any moment."""
_READERS: tuple[tuple[str, Callable[[Path], object]], ...] = (
    ("map.yaml", load_map),
    ("session.npz", load_session),
    ("report.json", read_report),
    ("edits.yaml", edits_beside),
    ("trajectory.tum", load_run),
    ("trajectory.tum", lambda folder: load_tum(folder / "trajectory.tum")),
)
"""Each with a file that it needs."""


@dataclass(frozen=True, eq=False)
class Replacement:
    """What is done in the working directory, and what its output folder holds before and afterwards."""

    earlier: Callable[[], object]
    new: Callable[[], object]
    out: str = "out"

    @cached_property
    def home(self) -> Path:
        """A working directory with the earlier run, to be copied."""
        home = _new_folder()
        shutil.copytree(_inputs(), home, dirs_exist_ok=True)
        with _working_in(home):
            self.earlier()  # in this process, so that no fork has to import and compile what it uses
        return home

    @cached_property
    def runs(self) -> tuple[dict[str, str], dict[str, str]]:
        """The contents of the earlier and of the new folder."""
        with TemporaryDirectory() as folder:
            home = _copied(self.home, folder)
            in_fork(partial(_within, home, self.new))
            return _contents(self.home, self.out), _contents(home, self.out)

    @cached_property
    def calls(self) -> int:
        """To how many calls at which it may be killed the work comes."""
        with TemporaryDirectory() as folder:
            return calls_of(partial(_within, _copied(self.home, folder), self.new))

    @cached_property
    def seconds(self) -> float:
        """How long it takes."""
        with TemporaryDirectory() as folder:
            home, began = _copied(self.home, folder), time.monotonic()
            in_fork(partial(_within, home, self.new))
            return time.monotonic() - began

    def fault_after(
        self, kill: Callable[[Callable[[], object]], bool], read: Callable[[Path], object]
    ) -> str:
        """How the rule was broken when the work was killed and the folder read; empty where it was not."""
        with TemporaryDirectory() as folder:
            home = _copied(self.home, folder)
            work = partial(_within, home, self.new)
            kill(work)
            earlier, new = self.runs
            changed = {name for name in earlier.keys() & new.keys() if earlier[name] != new[name]}
            seen = _contents(home, self.out)
            if len({seen[name] == new[name] for name in changed & seen.keys()}) > 1:
                return "other programs see files of both runs"
            read(home / self.out)
            if _contents(home, self.out) not in (earlier, new):
                return "files of both runs are read"
            in_fork(work)
            if _contents(home, self.out) != new:
                return "the next run is not whole"
            left = (
                {path.name for path in home.rglob("*")}
                - _names(self.home)
                - {Path(name).name for name in new}
            )
            return f"the next run leaves {', '.join(sorted(left))}" if left else ""


def trial(number: int) -> str:
    """The fault after a kill, if any; the same number gives the same command and the same call."""
    rng = random.Random(number)
    name = list(REPLACEMENTS)[number % len(REPLACEMENTS)]
    replacement = REPLACEMENTS[name]
    shared = replacement.runs[0].keys() & replacement.runs[1].keys()
    read = rng.choice([reader for file, reader in _READERS if file in shared])
    if rng.random() < _AT_A_CALL:
        call = int(replacement.calls * (1.0 - rng.random() ** 2))  # the later ones are those that matter
        kill, when = partial(killed_at, call), f"at call {call} of {replacement.calls}"
    else:
        seconds = rng.uniform(0.0, replacement.seconds)
        kill, when = partial(killed_after, seconds), f"after {seconds:.3f} s of {replacement.seconds:.3f} s"
    try:
        fault = replacement.fault_after(kill, read)
    except Exception as error:  # of a reader, or of the next run
        fault = f"{type(error).__name__}: {error}"
    return fault and f"{name} killed {when}: {fault}"


def prepare() -> None:
    """Make all that is to be replaced, and measure the work that does it."""
    for replacement in REPLACEMENTS.values():
        assert replacement.runs and replacement.calls and replacement.seconds


def _racecar(*arguments: str) -> None:
    assert run([*arguments, "--quiet"]) == 0


def _save_live(resolution: float) -> None:
    config = MappingConfig(resolution=resolution)
    mapper = Mapper(config)
    with BagReader(Path("a.bag")) as reader:
        for message in reader:
            feed(message, mapper)
    MapOutput(Path("out"), Config(mapping=config), {"live": True}).save([mapper])


MAP = ("map", "a.bag", "--out", "out", "--record", "--replace")
BATCH = ("map", "--batch", "bags", "--out", "out", "--replace")
MERGE = ("merge", "a", "b", "--out", "out", "--replace")
RENDER = ("render", "a", "--out", "out", "--replace", "--edits")
LOCALIZE = ("localize", "b.bag", "--map", "a", "--out", "out", "--record", "--replace")
COARSE = ("--config", "coarse.yaml")
REPLACEMENTS = {
    "map": Replacement(partial(_racecar, *MAP, *COARSE), partial(_racecar, *MAP)),
    "render": Replacement(
        partial(_racecar, *RENDER, "edits.yaml"), partial(_racecar, *RENDER, "out/fewer.yaml")
    ),
    "localize": Replacement(partial(_racecar, *LOCALIZE, "--seed", "1"), partial(_racecar, *LOCALIZE)),
    "continue": Replacement(
        partial(_racecar, *MAP),
        partial(_racecar, "map", "b.bag", "--continue", "a", "--out", "out", "--record", "--replace"),
    ),
    "merge": Replacement(partial(_racecar, *MERGE, *COARSE), partial(_racecar, *MERGE)),
    "batch": Replacement(partial(_racecar, *BATCH, *COARSE), partial(_racecar, *BATCH), out="out/a"),
    "live map": Replacement(partial(_save_live, 0.1), partial(_save_live, 0.05)),
}


@cache
def _inputs() -> Path:
    """A folder with two drives, their maps, and what a user has written."""
    home = _new_folder()
    for name, content in INPUTS.items():
        (home / name).parent.mkdir(exist_ok=True)
        (home / name).write_text(content)
    (home / "bags").mkdir()
    building = load_map("building")
    first = Simulation(building, SimulationConfig(seed=1, duration=8.0))
    write_bag(first, home / "a.bag", lambda share: None)
    halfway = first.ground_truth.map_from_base[len(first.ground_truth) // 2]
    x, y, yaw = halfway.tolist()
    second = Simulation(building, SimulationConfig(seed=2, duration=4.0, start=(x, y, yaw)))
    write_bag(second, home / "b.bag", lambda share: None)
    shutil.copy(home / "a.bag", home / "bags")
    with _working_in(home):
        for name in ("a", "b"):
            _racecar("map", f"{name}.bag", "--out", name)
    return home


def _new_folder() -> Path:
    folder = Path(mkdtemp(prefix="kills-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder


@contextmanager
def _working_in(home: Path) -> Iterator[None]:
    here = Path.cwd()
    os.chdir(home)
    try:
        yield
    finally:
        os.chdir(here)


def _within(home: Path, work: Callable[[], object]) -> None:
    """Do some work in a folder; for processes that do nothing else."""
    os.chdir(home)
    work()


def _copied(home: Path, folder: str) -> Path:
    return Path(shutil.copytree(home, Path(folder, "home"), symlinks=True))


def _names(home: Path) -> set[str]:
    return {path.name for path in home.rglob("*")}


def _contents(home: Path, out: str) -> dict[str, str]:
    """The files of a run, as any program sees them."""
    folder = home / out
    files = {str(path.relative_to(folder)): path for path in folder.rglob("*") if path.is_file()}
    return {name: _digest(path) for name, path in files.items() if not name.startswith(".racecar")}


def _digest(path: Path) -> str:
    content = path.read_bytes()
    if path.name == "report.json":
        report = json.loads(content)
        kept = {section: figures for section, figures in report.items() if section not in _VOLATILE}
        content = _HOME.sub("home", json.dumps(kept)).encode()
    return hashlib.sha256(content).hexdigest()
