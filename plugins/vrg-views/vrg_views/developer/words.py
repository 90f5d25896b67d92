"""The words of the drawer."""

from typing import Final

WAITING: Final = "Waiting for the referee"
WINDOW_SEAT: Final = "This page has a window's seat: it may stop everything, but not decide."
NOT_HEARD: Final = "This seat may not hear: {}"
SUMMARY: Final = "{count} streams, {rate:.0f} messages/s, {bandwidth:.0f} kB/s, {lost} lost"

MOST: Final = "Publishing most, kB/s: {}"

CONDITIONS: Final = "START CONDITIONS"
NOTHING_WAITS: Final = "Nothing is missing."
HALTED: Final = "HALTED"
WAY_OUT: Final = "Way out: {}"
AUCTIONS: Final = "AUCTIONS"
NO_AUCTION: Final = "No auction is open."
AUCTION_OPEN: Final = "{lot}: open since {opened}, for {lasts:.1f} s at least"
AUCTION_WON: Final = "{lot}: won by {winner}, open since {opened}"
BID: Final = "{player} bids {cost:.1f}"
NO_BID: Final = "{player} has not bid"
LEASES: Final = "LEASES"
NO_LEASE: Final = "Every player drives itself."
LEASE_OF_REFEREE: Final = "{player}: the referee drives it, {v:.1f} m/s and {w:.0f} °/s, until it ends that"
LEASE_OF_PERSON: Final = "{player}: a person drives it"
LEASE_UNTIL: Final = "{player}: a person drives it for another {rest:.1f} s"
CALLS: Final = "CALLS"
NO_CALL: Final = "Nothing has been called since the page was served."

NOBODY_SELECTED: Final = "Click a player in the list or on the field."
NO_PROCESSES: Final = "No launcher reports processes."
NOTHING_HEARD: Final = "Nothing has been heard yet."
UNKNOWN: Final = "–"
