"""What single shader nodes add to a material's sum, a subject a file."""
