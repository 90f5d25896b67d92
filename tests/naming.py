"""Names as people may choose them, in every language."""

from hypothesis import strategies as st

from vrg.names import is_name, normal

_LETTERS = st.characters(categories=["L", "N", "M"], include_characters="_-")
"""What names are made of, so that few texts are none."""


def names(longest: int = 64) -> st.SearchStrategy[str]:
    """Names of at most so many characters."""
    return st.text(_LETTERS, min_size=1, max_size=longest).map(normal).filter(is_name)
