"""What `compiling` adds to Numba: how parts are compiled, and how named tuples become pointers.

These files import Numba, so they are imported only where kernels are needed. They belong to every kernel's
digest.
"""
