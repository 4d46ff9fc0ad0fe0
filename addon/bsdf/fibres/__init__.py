"""Fibres: the lobe of hair, which scatters to all sides around a strand."""
