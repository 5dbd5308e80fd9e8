"""Expected ranges for every free cell and heading, computed beforehand."""
