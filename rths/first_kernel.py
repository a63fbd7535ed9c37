"""The place where a command first loads kernels: from there on it says when they are compiled.

Most commands load kernels only when they need them, and some never do. Loading Numba to listen to it would make those
slower.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # to load them takes a tenth of the start of `rths --help`
    from importlib.machinery import ModuleSpec

KERNELS = "models.compiled"  # which every module with a kernel imports first


class FirstKernel:
    """Finds no module, but enters a context when the first kernel is about to be loaded."""

    def __init__(self, within: contextlib.ExitStack) -> None:
        self._within = within

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """Nothing: the finders behind this one find the module."""
        if fullname == KERNELS:
            listen(self._within)
        return None


def listen(within: contextlib.ExitStack) -> None:
    """Notice compilations until a stack of contexts ends."""
    from simulation import compilation

    within.enter_context(compilation.noticed())


@contextlib.contextmanager
def compilation_said() -> Iterator[None]:
    """Within the context, a user who waits for the compiler is told so, once."""
    with contextlib.ExitStack() as within:
        if KERNELS in sys.modules:
            listen(within)
            yield
            return
        finder = FirstKernel(within)
        sys.meta_path.insert(0, finder)
        within.callback(sys.meta_path.remove, finder)
        yield
