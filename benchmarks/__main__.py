from benchmarks.commands import app
from benchmarks.harness.command import TITLE
from racecar.pipelines.commands.cli import main

if __name__ == "__main__":
    main(app, TITLE)
