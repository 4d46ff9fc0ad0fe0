"""The stages of a bake in order, for receivers, a camera and probes; and what a bake will take."""
