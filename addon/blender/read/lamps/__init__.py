"""Reads lamps and the world."""
