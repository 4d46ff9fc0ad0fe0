"""Actions that change settings alone."""
