"""The recording of a case as its logger leaves it."""

from __future__ import annotations

from pathlib import Path

from common.plan.plan import Plan
from validation.blind.cases.case import Case, levels
from validation.blind.logger.loggers import LOGGERS
from validation.blind.logger.own_clock import write_down
from validation.blind.logger.relogging import relog


def log(case: Case, plan: Plan, played: Path, output: Path) -> None:
    """Write into `output` what the logger of a case recorded of the test without noise in `played`."""
    logger = LOGGERS[case.logger]
    if logger.clock is None:
        relog(played, output, plan, logger, levels(case.truths), case.seed)
    else:
        write_down(case, plan, played, output, logger, logger.clock)
