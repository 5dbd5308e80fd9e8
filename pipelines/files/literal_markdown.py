"""Escaping text, such as file names, so Markdown shows it unchanged."""

_SPECIAL = "&<>*_`[]{}|\\~#$!"
"""Characters with a meaning in Markdown or the HTML in it."""


def literal(text: str) -> str:
    """Escape text for Markdown, with special characters as numeric HTML references."""
    return "".join(f"&#{ord(each)};" if each in _SPECIAL else each for each in text)
