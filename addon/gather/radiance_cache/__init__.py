"""Diffuse radiance of both sides of the elements that surfaces are cut into."""
