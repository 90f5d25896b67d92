"""Pages of HTML that need no other file, no network and no program: templates that are filled with data."""

from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup

_TEMPLATES = Environment(loader=PackageLoader(__name__, ""), autoescape=True, trim_blocks=True, lstrip_blocks=True)


def rendered(template: str, **data: Any) -> Markup:
    """The text of a template; whatever stands in the data is text there, and no HTML."""
    return Markup(_TEMPLATES.get_template(template).render(data))
