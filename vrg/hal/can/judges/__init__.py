"""The judges of a robot's guard: each judges one thing, by the reports of the drives and the time that it is given.

A judge has no bus, no clock and no thread, orders nothing and knows no other judge. What it finds is a `Reason`; the
guard asks the judges in a fixed order, and acts.

    reasons     what a judge may find, and its words
    silence     drives that are not heard, for good or again and again, or that make no sense
    identity    drives that are not those that they were
    supply      supplies that no battery of the robot has
    start       drives that do not start, or do not stay on, though they were asked to
    off         drives that stay on, or turn on, though they were ordered to be off
    proof       whether the drives' own watchdogs have been seen to work
"""
