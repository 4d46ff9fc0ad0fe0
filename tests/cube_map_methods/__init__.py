"""Other methods to find hits in cube maps, which the one that ships is compared with."""
