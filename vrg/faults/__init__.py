"""Whole matches with faults in simulated time: processes, links and disks that fail, all by a seed."""
