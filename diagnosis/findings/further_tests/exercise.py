"""Effects that a recording could not have shown, for its motion was too small or its times mean nothing."""

from __future__ import annotations

import numpy as np

from common.errors import InputError
from diagnosis.findings.found import Diagnosis
from diagnosis.fits import hypothesis
from diagnosis.fits.worth import SEEN


def not_exercised(found: Diagnosis) -> tuple[str, ...]:
    """Names of the effects that even at the largest of their usual sizes would not have stood out of the noise."""
    result = []
    for verdict in found.verdicts:
        data, fit = verdict.search.data, verdict.search.chosen
        whole = data.part.predict(hypothesis.lay(data, fit.z, fit.values))
        for effect in data.part.candidates:
            strength = [item for item in effect.parameters if not item.shape]
            if effect.name in fit.names or len(strength) != 1:
                continue
            shapes = {item.name: item.default for item in effect.parameters if item.default is not None}
            values = {**shapes, strength[0].name: strength[0].sizes[-1]}
            try:
                more = data.part.predict(hypothesis.lay(data, fit.z, fit.values | {effect.name: values}))
            except InputError:
                result.append(effect.name)
                continue
            change = np.where(data.part.present, (more - whole) / data.sigma, 0.0)
            if float(np.max(np.sqrt(np.mean(change**2, axis=0)))) < SEEN:
                result.append(effect.name)
    return (*result, *untimed(found))


def untimed(found: Diagnosis) -> list[str]:
    """Names of the effects on rates at the sites that were searched, where times have no meaning."""
    if not found.record.static:
        return []
    sites = {effect.site for one in found.verdicts for effect in one.search.data.part.candidates}
    return [
        effect.name for effect in found.record.catalogue.values() if effect.timed and effect.site in sites
    ]
