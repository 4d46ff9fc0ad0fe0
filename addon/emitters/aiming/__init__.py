"""Where photons are sent: to the receivers' region, to what makes caustics, and where pilots found them worth much."""
