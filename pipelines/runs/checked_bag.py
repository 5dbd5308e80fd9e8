"""What is in a bag, what is wrong with it, and what whoever maps it will find out."""

from racecar.pipelines.bags.check import BagCheck, check_bag
from racecar.pipelines.bags.reader import BagReader
from racecar.pipelines.runs.calibration_run import calibrate
from racecar.pipelines.runs.progress import progress_bar


def check_reader(reader: BagReader, *, quiet: bool) -> BagCheck:
    """Read an open bag once, and its beginning twice. Raises UserError when no scan of it is usable."""
    foreseen = calibrate(reader, quiet=quiet)
    with progress_bar("Reading", reader.message_count, quiet=quiet) as advance_to:
        checked = check_bag(reader, advance_to)
    checked.findings.extend(foreseen)
    return checked
