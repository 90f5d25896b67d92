"""The referee: the runtime that owns stages, clock and journal, and the rule books."""
