"""Pure kernels of the hybrid test: floats in, floats out; no clock, no input or output, no logging."""
