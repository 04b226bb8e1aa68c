"""Slow and obvious references that the tests compare the library with."""
