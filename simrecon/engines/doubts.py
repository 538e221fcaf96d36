"""Second thoughts: a window whose loss rises steeply is solved again from the window before it.

Where a window ends the next one must begin. A foot that is put down a little too far costs nothing yet, but
from there no balance may be found: the loss of the next window rises to a multiple, and that of all that
follow, long before the body leaves the corridor. Other random numbers often put the foot elsewhere.
"""

from __future__ import annotations

from simrecon.plan import Recovery
from simrecon.types import Effort, WindowResult


def doubtful(recovery: Recovery, before: WindowResult, result: WindowResult) -> bool:
    """Whether a window's loss is in doubt: above the plan's `doubt_loss`, and `doubt` times the last one.

    A window that was solved again, for whatever reason, isn't.
    """
    if not recovery.doubt or before.effort.retry or result.effort.retry or result.effort.again:
        return False
    return result.loss > max(recovery.doubt_loss, recovery.doubt * before.loss)


def again(before: WindowResult, result: WindowResult) -> Effort:
    """With what both windows are solved again."""
    return Effort(until=result.window.index, again=before.effort.again + 1)


def better(tried: list[WindowResult], stands: list[WindowResult]) -> bool:
    """Whether windows that were tried are better than those that stand."""
    return sum(result.loss for result in tried) < sum(result.loss for result in stands)
