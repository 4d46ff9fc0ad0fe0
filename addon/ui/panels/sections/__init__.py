"""Sections of the panel that fold away, a file each."""
