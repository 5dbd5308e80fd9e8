"""The files of a live drive: its map, and the checkpoints from which it goes on."""
