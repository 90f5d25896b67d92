"""Arithmetic that gives the same bits on every computer: of numbers (`scalars`) and of arrays (`arrays`)."""
