"""The files that `vrg new` writes, as templates: `$name` and the like stand for what the person has chosen."""

from importlib.resources import files
from string import Template


def filled(template: str, **words: str) -> str:
    """Return the text of a template with words in place of its placeholders.

    Args:
        template: the template's path in this folder, such as `driver/driver.py.template`.
        words: the word for each placeholder. A placeholder without a word is the caller's mistake.

    Raises:
        KeyError: a placeholder has no word.
    """
    return Template(files(__name__).joinpath(template).read_text(encoding="utf-8")).substitute(words)
