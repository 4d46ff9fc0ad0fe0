"""Other times of the shutter: when they are, where things are then, and the file as it was afterwards."""
