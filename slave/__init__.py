"""Laboratory B: drives a laboratory of any kind by what the master sends."""
