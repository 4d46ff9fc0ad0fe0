"""How a ray finds its hit in cube maps: traversal of their mips, crossings, the secant method."""
