"""Direct light at points: next-event estimation over lamps, emissive meshes and worlds."""
