"""The stages between a recorded sample and a filter: pairing, correction, oversampling."""
