"""What a camera sees: lenses, paths over mirrors, and the points that its pixels are made of."""
