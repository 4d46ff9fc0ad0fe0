"""Hair and points as triangles: strands as tubes, points as balls, so many that memory is bounded."""
