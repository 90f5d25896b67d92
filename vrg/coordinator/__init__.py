"""The coordinator: the runtime that owns stages, clock and journal, and the interface of the rule books."""
