"""How a bake runs: what it reads, solves and writes, on its own thread."""
