"""The bag formats, whole or damaged, as topics and raw messages."""
