"""Machines other than the launcher's: an agent runs on each, brought up by ssh, and supervises the processes there."""
