"""How media scatter light: phase functions, as parts of kernels and as tables of rings."""
