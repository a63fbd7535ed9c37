"""The two laboratories as kernels: command in, true motion and force at the next tick out."""
