"""What came of writing light."""

from dataclasses import dataclass, field
from pathlib import Path


@dataclass
class Written:
    """What was written, and what was not.

    Attributes
    ----------
    files : list of Path
        That were written.
    places : list of str
        Where in the .blend file light is now, a line each.
    warnings : list of str
        What light should be known with.
    failures : list of str
        Sentences about what was to be written and could not be.
    """

    files: list[Path] = field(default_factory=list)
    places: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def add(self, other: "Written") -> None:
        """Count in what came of writing something else."""
        self.files += other.files
        self.places += other.places
        self.warnings += other.warnings
        self.failures += other.failures
