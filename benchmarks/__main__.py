from benchmarks.commands import TITLE, app
from racecar.pipelines.cli import main

if __name__ == "__main__":
    main(app, TITLE)
