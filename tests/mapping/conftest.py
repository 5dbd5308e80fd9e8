"""Lets the tests of this room import ``worlds``, which pytest's importlib mode leaves out."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
