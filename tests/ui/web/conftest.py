"""A port for each test's server, and browsers that visit its page."""

from vrg.testing.views.browser import browser
from vrg.testing.views.page import drawers, page_admission, port, server, visit

__all__ = ["browser", "drawers", "page_admission", "port", "server", "visit"]
