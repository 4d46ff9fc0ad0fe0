"""How live light gets about: direct light onto elements and vertices, and links that carry it from there."""
