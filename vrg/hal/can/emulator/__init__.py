"""The common part of emulated drives: a motor, faults on request, a base class, and the shell that runs them."""
