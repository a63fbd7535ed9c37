"""Errors of several readings that follow from one motion of a machine."""

from __future__ import annotations

import numpy as np

from diagnosis.findings.sites.likely import APART, TRUE_LEAVES, ranked
from diagnosis.findings.sites.signatures import signatures
from diagnosis.fits import hypothesis
from diagnosis.fits.search import Search
from diagnosis.recorded.joined import laboratory_of
from laboratories.effects.sites import is_sensor

STILL = np.array([1e-3])  # Hz, at which a machine stands where its constant force or place puts it


def one_motion(search: Search) -> bool:
    """Whether nothing but errors of several readings is named, and these follow from one motion of a machine.

    One cause at the machine is likelier than two that agree by chance.
    """
    effects = [search.data.catalogue[name] for name in search.chosen.names]
    if len({item.site for item in effects}) < 2 or {item.kind for item in effects} != {"measurement"}:
        return False
    near = [item for item in ranked(search.commissioned) if item.cost < APART and item.left < TRUE_LEAVES]
    return any(not is_sensor(item.site) for item in near) or one_place(search)


def one_place(search: Search) -> bool:
    """Whether offsets of several readings are named that are those of a machine which stands elsewhere.

    A valve that opens later on one side leaves the piston elsewhere, and its column with another force.
    """
    data, fit, part = search.data, search.chosen, laboratory_of(search.data.part)
    offsets = [name for name in fit.names if data.catalogue[name].motionless]
    if part is None or len({data.catalogue[name].site for name in offsets}) < 2:
        return False
    less = hypothesis.lay(
        data, fit.z, {name: values for name, values in fit.values.items() if name not in offsets}
    )
    change = data.part.predict(hypothesis.lay(data, fit.z, fit.values)) - data.part.predict(less)
    apart = np.mean(change, axis=0) / data.sigma
    machines = [one for one in signatures(part, less, STILL) if not is_sensor(one.site)]
    ways = [np.real(one.readings[0]) / data.sigma for one in machines]
    shares = [float(way @ apart) ** 2 / max(float(way @ way), 1e-300) for way in ways]
    return max(shares, default=0.0) > (1.0 - TRUE_LEAVES) * float(apart @ apart)
