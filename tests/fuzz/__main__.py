"""Tries many damaged inputs, and kills commands: ``python -m tests.fuzz``, or ``make fuzz``.

An input that fails is kept in a folder of its own, with a file that says why; ``--only NUMBER`` tries it
again, and ``--kill NUMBER`` a kill.
"""

import argparse
import multiprocessing
import os
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

from tests.fuzz import kills
from tests.fuzz.inputs import COMMANDS, Inputs
from tests.fuzz.trial import Outcome, run_trial

_inputs: Inputs


def main() -> int:
    """Returns 1 when an input broke the rule."""
    parser = argparse.ArgumentParser(prog="python -m tests.fuzz", description=__doc__)
    parser.add_argument("--inputs", type=int, default=20_000, help="how many")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--only", type=int, help="number of the one to try; its files are kept in any case")
    parser.add_argument("--samples", nargs="+", default=(), help="only of samples whose names hold these")
    parser.add_argument("--kills", type=int, default=300, help="how many kills")
    parser.add_argument("--kill", type=int, help="number of the one to try")
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path("fuzz"), help="folder for inputs that fail")
    options = parser.parse_args()
    if options.kill is not None:
        fault = kills.trial(options.kill)
        print(fault or "as it should be")
        return bool(fault)
    prepare(words=tuple(options.samples))
    numbers = range(options.first, options.first + options.inputs)
    if options.only is not None:
        outcome = _try(options.only)
        _keep(options.out, options.only, outcome)
        print(outcome.output, outcome.fault or f"exit code {outcome.exit_code}: as it should be")
        return bool(outcome.fault)
    faults = _try_all(partial(_fault, options.out), numbers, options.processes)
    if options.kills:
        kills.prepare()
        faults += _try_all(kills.trial, range(options.kills), options.processes)
    return bool(faults)


def _try_all(fault_of: Callable[[int], str], numbers: range, processes: int | None) -> int:
    """How many of the numbers break the rule."""
    faults, began = 0, time.monotonic()
    with multiprocessing.get_context("fork").Pool(processes) as pool:
        for done, fault in enumerate(pool.imap(fault_of, numbers, chunksize=4), start=1):
            if fault:
                faults += 1
                print(f"{numbers[done - 1]}: {fault}", flush=True)
            if done % 50 == 0 or done == len(numbers):
                rate = done / (time.monotonic() - began)
                print(f"{done} of {len(numbers)}, {faults} faults, {rate:.1f}/s", flush=True)
    return faults


def prepare(commands: tuple[str, ...] = COMMANDS, words: tuple[str, ...] = ()) -> Inputs:
    """Make the samples and do what is done with them, so that all is imported and compiled.

    Raises AssertionError where a healthy sample is not read.
    """
    global _inputs
    _inputs = Inputs(commands, words)
    here, done = Path.cwd(), set[str]()
    for sample in _inputs.healthy:
        is_broken, once = not sample.damaged, done - {"", "check", "page"}
        if is_broken or sample.command not in (*commands, "") or sample.command in once:
            continue
        with tempfile.TemporaryDirectory() as folder:
            sample.write(Path(folder))
            if sample.command not in (*done, "page"):  # whose threads must not be forked
                os.chdir(folder)
                sample.action()
                os.chdir(here)
            outcome = run_trial(sample.action, Path(folder), sample.seconds)
        done.add(sample.command)
        if outcome.fault or outcome.exit_code:
            raise AssertionError(f"{sample.name} {sample.command}: {outcome}")
    return _inputs


def _try(number: int) -> Outcome:
    with tempfile.TemporaryDirectory() as folder:
        sample = _inputs.make(number).sample
        sample.write(Path(folder))
        return run_trial(sample.action, Path(folder), sample.seconds)


def _fault(out: Path, number: int) -> str:
    """How an input broke the rule, and where it is kept; empty where it kept the rule."""
    outcome = _try(number)
    return outcome.fault and f"{outcome.fault}, kept in {_keep(out, number, outcome)}"


def _keep(out: Path, number: int, outcome: Outcome) -> Path:
    """Write an input that failed, and why."""
    kept = _inputs.make(number)
    folder = out / str(number)
    kept.sample.write(folder)
    why = f"{kept.sample.name} {kept.sample.command}\n{kept.what}\n{outcome.fault}\n{outcome.output}"
    (folder / "why.txt").write_text(why)
    return folder


if __name__ == "__main__":
    sys.exit(main())
