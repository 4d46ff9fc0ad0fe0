"""Light of several frames played back on objects: a Geometry Nodes modifier reads it from an image into attributes."""

from .modifiers import MODIFIER, Track, add_playback, has_playback, remove_playback

__all__ = ["MODIFIER", "Track", "add_playback", "has_playback", "remove_playback"]
