"""A package of somebody else: whatever VRG can be extended by, once, and nothing of it known to VRG."""

from pathlib import Path

ISLAND = Path(__file__).with_name("island.toml")
