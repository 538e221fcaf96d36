"""Wishes as they are painted on the strip."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from simrecon.contact import wishes
from simrecon.errors import InputError
from simrecon.studio import strip
from simrecon.types import ContactWish

PART = "left_heel"
TIMES = st.integers(0, 40).map(lambda tick: tick / 10)


def test_an_interval_goes_over_what_was_there() -> None:
    asked = strip.painted((), PART, "touch", (0.0, 1.0))
    asked = strip.painted(asked, PART, "free", (0.4, 0.6))
    assert asked == (ContactWish(PART, "auto", ((0.0, 0.4), (0.6, 1.0)), ((0.4, 0.6),)),)
    asked = strip.painted(asked, PART, "touch", (0.6, 0.3))
    assert asked == (ContactWish(PART, "auto", ((0.0, 1.0),)),)
    assert strip.painted(asked, PART, "clear", (0.0, 2.0)) == ()


def test_auto_is_nothing_but_where_a_mode_holds() -> None:
    assert strip.painted((), PART, "auto", (0.0, 1.0)) == ()
    always = strip.with_mode((), PART, "always")
    assert strip.painted(always, PART, "auto", (0.0, 1.0))[0].auto == ((0.0, 1.0),)
    assert strip.with_mode(always, PART, "auto") == ()


def test_what_is_no_wish_is_refused() -> None:
    for part, brush, span in (("nose", "touch", (0, 1)), (PART, "red", (0, 1)), (PART, "free", (1, 1))):
        with pytest.raises(InputError, match="valid"):
            strip.painted((), part, brush, span)
    for part, mode in (("nose", "always"), (PART, "sometimes")):
        with pytest.raises(InputError, match="valid"):
            strip.with_mode((), part, mode)


@settings(max_examples=40)
@given(st.lists(st.tuples(st.sampled_from(strip.BRUSHES), TIMES, TIMES), max_size=12))
def test_whatever_is_painted_is_a_file_that_can_be_read(strokes: list[tuple[str, float, float]]) -> None:
    """And the last stroke is the one that holds in its middle."""
    asked: tuple[ContactWish, ...] = strip.with_mode((), PART, "always")
    for brush, low, high in strokes:
        if low == high:
            continue
        asked = strip.painted(asked, PART, brush, (low, high))
        assert wishes.build(wishes.to_table(asked), "test") == asked
        middle, wish = (low + high) / 2, asked[0]
        here = [kind for kind in wishes.KINDS for a, b in getattr(wish, kind) if a <= middle <= b]
        assert here == ([] if brush == "clear" else [brush])
