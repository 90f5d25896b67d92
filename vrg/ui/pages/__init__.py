"""Pages of HTML that need no other file, no network and no program: templates that are filled with data."""

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader
from markupsafe import Markup


@cache
def _templates(package: str) -> Environment:
    return Environment(loader=PackageLoader(package, ""), autoescape=True, trim_blocks=True, lstrip_blocks=True)


def rendered(template: str, *, package: str = __name__, **data: Any) -> Markup:
    """The text of a template of a package; whatever stands in the data is text there, and no HTML."""
    return Markup(_templates(package).get_template(template).render(data))
