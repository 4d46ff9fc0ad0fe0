"""What people may ask of a bake: every parameter with its default, range and meaning."""
