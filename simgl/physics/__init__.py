"""Numbers, frames, spectra and ephemerides; float64, SI, no graphics."""
