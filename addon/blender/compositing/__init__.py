"""A camera's pass in a scene's compositor: its files, its nodes, and renders of direct light alone to go with it."""
