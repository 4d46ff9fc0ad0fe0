"""Hair and points as Cycles renders them: hair curves, particle hair, point clouds; as triangles that light meets."""
