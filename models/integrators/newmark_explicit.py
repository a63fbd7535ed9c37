"""Explicit Newmark."""
import numpy as np
from models.compiled import jit
from models.integrators.state import *
HALF=5
def coefficients(M,C,K,interval,**options):
    return np.stack([np.linalg.inv(M+0.5*interval*C), C])
@jit
def step(c,s,g,interval):
    n=g.size
    for i in range(n):
        s[0,i]=s[3,i]
    for i in range(n):
        r=g[i]
        for j in range(n): r-=c[1,i,j]*s[5,j]
        s[6,i]=r
    for i in range(n):
        a=0.0
        for j in range(n): a+=c[0,i,j]*s[6,j]
        s[2,i]=a
        s[1,i]=s[5,i]+0.5*interval*a
        s[5,i]=s[1,i]+0.5*interval*a
        s[3,i]=s[0,i]+interval*s[5,i]
        s[4,i]=s[1,i]+interval*a
