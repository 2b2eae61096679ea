"""Target spectra, and the adjustment of motions to them."""
