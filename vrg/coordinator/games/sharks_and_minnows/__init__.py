"""Sharks and Minnows: its rules, settings and default match."""

from vrg.coordinator.games.sharks_and_minnows.rules import SharksAndMinnows
from vrg.coordinator.games.sharks_and_minnows.settings import Settings
from vrg.coordinator.games.sharks_and_minnows.state import MINNOW, SHARK, State

__all__ = ["MINNOW", "SHARK", "Settings", "SharksAndMinnows", "State"]
