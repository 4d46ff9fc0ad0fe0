"""Panels of what is baked to: each output has one."""
