"""Parameters of the devices from records of characterisation tests: pure functions, arrays in, numbers out.

Every array holds one value per tick k. Measurements are taken at `t_k`; a displacement command written at
`t_k` is ramped from the previous command and reached at `t_{k+1}`, unless it is said to be held like a force command,
which acts as a step at `t_k`.
"""
