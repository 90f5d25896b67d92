"""The packets of the RoboCup Small Size League: vision as a source of fixes, and a match as its tools see one."""
