"""The files of a live drive: its map, and the log from which it can be continued."""
