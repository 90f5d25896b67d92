"""What all emulated drives share: a motor, faults on request, the base class, and the shell that runs them on a bus."""
