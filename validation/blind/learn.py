"""Learning the probability of a verdict: `python -m validation.blind.learn RESULTS …`.

RESULTS are `results.json` of trials (`rths blind --json` or its folder), of the sets that tune and not of "judge". It
writes the weights as `diagnosis.findings.certainty.trust` holds them, and how good probabilities are on cases that the
weights were not learned from, by kind of case.

The model is a logistic regression with an L2 penalty on standardised signs. A weight whose sign contradicts what the
sign means is zero: more noise left, or more effects named, never make a verdict more probable. The penalty is that with
the best likelihood on withheld cases.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit

from common.errors import InputError
from common.terminal import cli
from diagnosis.findings.certainty.trust import SIGNS, Weights
from models.registry import Array
from report.text import terminal
from validation.blind.results.calibration import brier, expected_calibration_error
from validation.blind.results.stated import is_true

# Whether a larger sign makes a verdict more (1) or less (-1) probable.
SENSES = {"clear": 1.0, "names": -1.0}
PENALTIES = (
    0.3,
    1.0,
    3.0,
    10.0,
    30.0,
)  # half a decade apart: the likelihood changes little between two of them
JUDGED = ("kind", "truth", "asked", "listed", "surplus")  # what `is_true` takes
FOLDS = 10  # the usual number: each model learns from nine tenths of the cases
FEWEST = 20  # verdicts from which on weights are learned: below it a fold has hardly one that is wrong


class Verdicts(NamedTuple):
    """Verdicts that name something, one row each."""

    signs: Array  # (verdicts, signs)
    right: Array  # (verdicts,) 1 where it is true
    stated: Array  # (verdicts,) probability in the report
    kinds: tuple[str, ...]

    def those(self, chosen: Array) -> Verdicts:
        """The verdicts of some rows."""
        kinds = tuple(kind for kind, yes in zip(self.kinds, chosen, strict=True) if yes)
        return Verdicts(self.signs[chosen], self.right[chosen], self.stated[chosen], kinds)


def verdicts(cases: Sequence[dict[str, Any]], *, partly: bool) -> Verdicts:
    """The verdicts of judged cases that name something: those that explain, or those that do so partly."""
    rows = [
        item
        for item in cases
        if item["signs"]
        and item["probability"] is not None
        and (item["status"] == "partly_explained") == partly
    ]
    return Verdicts(
        np.array([[item["signs"][name] for name in SIGNS] for item in rows]).reshape(len(rows), len(SIGNS)),
        np.array([float(is_true(*(item[name] for name in JUDGED))) for item in rows]),
        np.array([item["probability"] for item in rows]),
        tuple(item["kind"] for item in rows),
    )


def learned(signs: Array, right: Array, penalty: float) -> Weights:
    """The weights with the largest penalised likelihood.

    `signs` (n, signs), `right` (n,) 0 or 1. The constant is not penalised; half a verdict is added to each side, so
    that it stays finite.
    """
    centre, scale = signs.mean(axis=0), np.maximum(signs.std(axis=0), 1e-9)
    design = (signs - centre) / scale
    senses = np.array([SENSES[name] for name in SIGNS])

    def cost(place: Array) -> tuple[float, Array]:
        odds = place[0] + design @ place[1:]
        both = np.logaddexp(0.0, place[0]) - 0.5 * place[0]
        value = float(np.sum(np.logaddexp(0.0, odds) - right * odds) + both)
        value += 0.5 * penalty * float(place[1:] @ place[1:])
        miss = expit(odds) - right
        slope = np.concatenate(([miss.sum() + expit(place[0]) - 0.5], design.T @ miss + penalty * place[1:]))
        return value, slope

    bounds = [(None, None), *((0.0, None) if sense > 0.0 else (None, 0.0) for sense in senses)]
    place = minimize(cost, np.zeros(1 + len(SIGNS)), jac=True, method="L-BFGS-B", bounds=bounds).x
    weights = place[1:] / scale
    constant = float(place[0] - weights @ centre)
    return Weights(constant, {name: float(weight) for name, weight in zip(SIGNS, weights, strict=True)})


def withheld(given: Verdicts, penalty: float) -> Array:
    """Probabilities (verdicts,) by weights that were learned from the other folds."""
    folds = np.arange(given.right.size) % FOLDS
    result = np.empty(given.right.size)
    for fold in range(FOLDS):
        seen = folds != fold
        weights = learned(given.signs[seen], given.right[seen], penalty)
        result[~seen] = said(weights, given.signs[~seen])
    return result


def said(weights: Weights, signs: Array) -> Array:
    """Probabilities (verdicts,) by weights."""
    return np.array([weights.probability(dict(zip(SIGNS, row, strict=True))) for row in signs])


def unlikelihood(stated: Array, right: Array) -> float:
    """Mean of -log of the probability of what came true."""
    return float(-np.mean(np.log(np.where(right > 0.5, stated, 1.0 - stated))))


def learn(given: Verdicts) -> tuple[Weights, Array, float]:
    """Weights, the probabilities of withheld verdicts, and the penalty."""
    tried = {penalty: withheld(given, penalty) for penalty in PENALTIES}
    best = min(tried, key=lambda penalty: unlikelihood(tried[penalty], given.right))
    return learned(given.signs, given.right, best), tried[best], best


def quality(name: str, stated: Array, withheld_: Array, right: Array) -> tuple[str, ...]:
    """A row: verdicts, share that is right, Brier skill and calibration error as stated and as learned."""
    share = float(right.mean())
    spread = share * (1.0 - share)
    cells = [name, str(right.size), f"{share:.2f}"]
    for values in (stated, withheld_):
        skill = f"{1.0 - brier(values, right) / spread:.2f}" if spread else "–"
        cells += [skill, f"{expected_calibration_error(values, right, 5):.3f}"]
    return tuple(cells)


def table(given: Verdicts, withheld_: Array) -> list[tuple[str, ...]]:
    """The quality by kind of case, and of all."""
    rows = []
    for kind in sorted(set(given.kinds)):
        chosen = np.array([one == kind for one in given.kinds])
        rows.append(quality(kind, given.stated[chosen], withheld_[chosen], given.right[chosen]))
    return [*rows, quality("all", given.stated, withheld_, given.right)]


def read(path: Path) -> list[dict[str, Any]]:
    """The judged cases of a trial."""
    try:
        return list(json.loads(path.read_text(encoding="utf-8"))["cases"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{path} holds no results of a blind trial ({error}): give its results.json."
        ) from None


def run(args: argparse.Namespace) -> int:
    """Learn and write."""
    cases = [case for path in args.results for case in read(path)]
    head = ("", "verdicts", "right", "skill, stated", "error", "skill, learned", "error")
    for partly in (False, True):
        given, title = verdicts(cases, partly=partly), "partly" if partly else "explained"
        if given.right.size < FEWEST or not 0.0 < given.right.mean() < 1.0:
            sys.stdout.write(f"{title}: {given.right.size} verdicts are too few to learn from.\n")
            continue
        weights, apart, penalty = learn(given)
        sys.stdout.write(f"{title}: penalty {penalty:g}, constant {weights.constant:.3g}\n")
        terminal.table([["sign", "weight"], *([name, f"{one:.3g}"] for name, one in weights.signs.items())])
        terminal.table([list(head), *map(list, table(given, apart))])
    return 0


def main() -> int:
    """Entry of `python -m validation.blind.learn`."""
    parser = argparse.ArgumentParser(
        prog="validation.blind.learn", description="Learn the probability of a verdict from blind trials."
    )
    parser.add_argument("results", type=Path, nargs="+", metavar="RESULTS", help="results.json of a trial")
    args = parser.parse_args()
    return cli.guarded(lambda: run(args))


if __name__ == "__main__":
    sys.exit(main())
