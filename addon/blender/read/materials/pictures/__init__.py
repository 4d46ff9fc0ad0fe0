"""What image textures show: images as Cycles interpolates them, averaged over texels; and files that are not there."""
