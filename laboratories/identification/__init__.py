"""Identifies parameters of devices from records of characterisation tests; all functions are pure.

Every array holds one value per tick k. Measurements are taken at `t_k`. A displacement command written at `t_k` is
ramped from the previous command and reached at `t_{k+1}`, unless it is held; a held command, as that of a force, acts
as a step at `t_k`.
"""
