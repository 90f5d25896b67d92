"""VRG as tools of a coding agent (Model Context Protocol): it writes players, lets them play, and looks at runs."""

from typing import Final

from vrg.plugins import Command

MCP: Final = Command(("mcp",), "Play", "Let a coding agent write players and play", "vrg_mcp.command:mcp")
