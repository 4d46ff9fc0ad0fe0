"""What the viewport shows besides: photons, cells and texel density."""
