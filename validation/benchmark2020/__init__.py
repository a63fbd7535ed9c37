"""The field's public benchmark of real-time hybrid simulation, recomputed with this system's models.

C. E. Silva, D. Gomez, A. Maghareh, S. J. Dyke and B. F. Spencer, Benchmark control problem for real-time hybrid
simulation, Mechanical Systems and Signal Processing 135 (2020) 106381.
"""
