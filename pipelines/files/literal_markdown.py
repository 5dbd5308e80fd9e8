"""Text that a page which reads Markdown shows as it is, such as the names of files."""

_SPECIAL = "&<>*_`[]{}|\\~#$!"
"""Characters that Markdown, or the HTML in it, would take for its own."""


def literal(text: str) -> str:
    """The same text for Markdown, its special characters as HTML names them by number."""
    return "".join(f"&#{ord(each)};" if each in _SPECIAL else each for each in text)
