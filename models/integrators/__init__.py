"""Integrators."""
from dataclasses import dataclass
from typing import Any
import numpy as np
from models.compiled import jit
from models.integrators import newmark_explicit
@dataclass(frozen=True)
class Method:
    code: int
    coefficients: Any
INTEGRATORS={"newmark_explicit":(0,newmark_explicit)}
def build(name,M,C,K,interval,rho):
    code,m=INTEGRATORS[name]
    return Method(code, np.ascontiguousarray(m.coefficients(M,C,K,interval)))
def rest(n): return np.zeros((8,n))
@jit
def step(kind,c,s,g,interval):
    newmark_explicit.step(c,s,g,interval)
