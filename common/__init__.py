"""What all parts of a hybrid test share: errors, roles, signals, the interface of a rig; rooms for the rest.

Importing it keeps linear algebra to one thread, unless the environment says otherwise. A laboratory's process at
real-time priority would wait in a busy loop for threads of ordinary priority, which then get no processor; and the
matrices here are too small to gain by threads.
"""

import os

for _library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")  # read when the library is loaded
