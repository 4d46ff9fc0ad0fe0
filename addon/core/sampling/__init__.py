"""Random streams, low-discrepancy sequences, and warps from the unit square with their densities."""
