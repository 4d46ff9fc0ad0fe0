"""Lamps whose nodes make their light differ: by direction (IES profiles, gobos), by place, and by distance."""
