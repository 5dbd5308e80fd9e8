"""The bag formats, intact or damaged, read as topics and raw messages."""
