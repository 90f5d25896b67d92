"""The words of the developers' view."""

from typing import Final

from vrg.ui.developer.choices import Layer, Tab

OVERLAYS: Final = {
    Layer.SCANS: ("Scans", "^1"),
    Layer.SENSORS: ("Sensors", "^2"),
    Layer.SIGHTINGS: ("Sightings", "^3"),
    Layer.SKETCHES: ("Sketches", "^4"),
    Layer.MEASURED: ("Measured", "^5"),
    Layer.TRAILS: ("Trails", "^6"),
    Layer.NAMES: ("Names", "^7"),
}
"""The label of each overlay's switch, and its key."""
TABS: Final = {
    Tab.REFEREE: ("Referee", "F2"),
    Tab.PLAYER: ("Player", "F3"),
    Tab.STREAMS: ("Streams", "F4"),
    Tab.PROCESSES: ("Processes", "F5"),
}
"""The label of each tab, and its key."""

WAITING: Final = "Waiting for the referee"
OFFICIAL_SEAT: Final = "An official's seat: it hears everything"
WINDOW_SEAT: Final = "A window's seat: it may stop everything, but not decide"
NOT_HEARD: Final = "This seat may not hear: {}"
SUMMARY: Final = "{count} streams, {rate:.0f} messages/s, {bandwidth:.0f} kB/s, {lost} lost"

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
CALLS: Final = "CALLS: CLICK ONE TO SEE WHY"
NO_CALL: Final = "Nothing has been called since this window was opened."

NOBODY_SELECTED: Final = "Click a player in the list or on the field."
NO_PROCESSES: Final = "No launcher tells of processes."
NOTHING_HEARD: Final = "Nothing has been heard yet."
UNKNOWN: Final = "–"
SELECT_FIRST: Final = "Select a player first."
