"""What every room stands on: errors, progress, parallel work, random numbers, and how kernels are compiled.

Knows nothing of scenes.
"""
