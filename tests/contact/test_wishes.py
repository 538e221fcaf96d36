"""`contacts.toml`: what can be asked for, by frame, and whether it holds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from simrecon.contact import honoured, wishes
from simrecon.contact.parts import names
from simrecon.errors import InputError
from simrecon.types import ContactLabels, ContactWish

TIMES = np.arange(11) / 10


def written(folder: Path, text: str) -> Path:
    path = folder / "contacts.toml"
    path.write_text(f'schema = "simrecon.contacts/1"\n{text}', encoding="utf-8")
    return path


def test_a_file_is_read_as_it_is_written(tmp_path: Path) -> None:
    asked = (
        ContactWish("left_heel", "always", (), ((0.2, 0.4),), ((0.5, 0.6),)),
        ContactWish("back", "never"),
        ContactWish("right_hand", "auto", ((0.1, 0.35),)),
    )
    path = tmp_path / "contacts.toml"
    path.write_text(wishes.dumps(asked, {"left_toe": ((0.0, 1 / 3),)}), encoding="utf-8")
    assert set(wishes.read(path)) == set(asked)  # what was found asks for nothing
    path.write_text(wishes.dumps(asked), encoding="utf-8")
    assert set(wishes.read(path)) == set(asked)
    assert wishes.build(wishes.to_table(asked), "job.toml") == wishes.read(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[left_foot]", r"unknown key 'left_foot'.*valid: left_heel"),
        ("[back]\nmode = 'allways'", r"\[back\] mode must be one of auto, always.*did you mean 'always'"),
        ("[back]\ntouch = [[1.0, 0.5]]", r"\[back\] touch: found \[1, 0.5\]; valid: \[from, to\]"),
        ("[back]\ntouch = [1.0, 0.5]", r"\[back\] touch must be a list"),
        ("[back]\ntouch = [[0.0, 0.5]]\nfree = [[0.4, 1.0]]", r"touch up to 0.5 s and free from 0.4 s"),
        ("[back]\nfound = [[0.5, 0.4]]", r"found: found \[0.5, 0.4\]"),
        ("[back]\nhold = 1", r"unknown key 'hold'"),
    ],
)
def test_what_cannot_be_asked_for_is_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as caught:
        wishes.read(written(tmp_path, text))
    assert "\n" not in str(caught.value)
    assert "contacts.toml" in str(caught.value)


def test_a_file_of_another_kind_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("[ground]\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"schema is None; valid: 'simrecon.contacts/1'"):
        wishes.read(path)


def test_intervals_come_before_the_mode() -> None:
    parts = names()
    asked = wishes.targets(
        (
            ContactWish("left_hand", "always", (), ((0.2, 0.4),), ((0.7, 0.9),)),
            ContactWish("right_hand", "grounded"),
            ContactWish("left_knee", "never", ((0.0, 0.1),)),
        ),
        TIMES,
    )
    assert asked is not None
    hand = parts.index("left_hand")
    assert np.flatnonzero(asked.free[:, hand]).tolist() == [2, 3, 4]
    assert np.flatnonzero(~(asked.touch | asked.free)[:, hand]).tolist() == [7, 8, 9]
    np.testing.assert_array_equal(asked.stay[:, hand], asked.touch[:, hand])
    assert asked.touch[:, parts.index("right_hand")].all()
    assert not asked.stay[:, parts.index("right_hand")].any()
    knee = parts.index("left_knee")
    assert np.flatnonzero(asked.touch[:, knee]).tolist() == [0, 1]
    assert np.flatnonzero(asked.free[:, knee]).tolist() == list(range(2, 11))
    assert wishes.targets((), TIMES) is None


def test_wishes_lie_over_labels() -> None:
    found = ContactLabels(names(), np.full((11, 11), np.nan), "rules")
    asked = wishes.targets((ContactWish("back", "auto", ((0.0, 0.1),), ((0.9, 1.0),)),), TIMES)
    back = wishes.over(found, asked).of("back")
    np.testing.assert_array_equal(back[[0, 1, 9, 10]], [1, 1, 0, 0])
    assert np.isnan(back[2:9]).all()
    assert wishes.over(found, None) is found


def test_an_interval_outside_of_the_clip_is_refused() -> None:
    asked = (ContactWish("back", "auto", ((2.0, 3.0),)),)
    with pytest.raises(InputError, match=r"\[back\] touch: found \[2, 3\].*seconds from 0 to 1"):
        wishes.check_times(asked, TIMES)
    wishes.check_times((ContactWish("back", "auto", ((0.95, 3.0),)),), TIMES)


def test_spans_hold_the_frames_that_they_are_made_of() -> None:
    flags = np.zeros(11, bool)
    flags[[0, 1, 2, 5, 9, 10]] = True
    found = wishes.spans(flags, TIMES)
    assert len(found) == 3
    asked = wishes.targets((ContactWish("back", "auto", found),), TIMES)
    assert asked is not None
    np.testing.assert_array_equal(asked.touch[:, names().index("back")], flags)


def test_a_wish_holds_where_the_part_touches_and_is_still() -> None:
    asked = wishes.targets((ContactWish("back", "always", (), ((0.8, 1.0),)),), TIMES)
    assert asked is not None
    back = names().index("back")
    touches, speed = np.zeros((11, 11), bool), np.zeros((11, 11))
    touches[:9, back] = True
    speed[4, back] = 1.0
    stays, free = honoured.honoured(asked, touches, speed)
    assert (stays.kind, free.kind) == ("stay", "free")
    assert stays.share == pytest.approx(7 / 8)
    assert free.share == pytest.approx(2 / 3)


def test_what_is_far_from_everything_cannot_touch() -> None:
    asked = wishes.targets((ContactWish("back", "always"),), TIMES)
    assert asked is not None
    clearance = np.zeros((11, 11))
    clearance[3:5] = 1.0
    back = names().index("back")
    assert np.flatnonzero(honoured.impossible(asked, clearance)[:, back]).tolist() == [3, 4]
    kept = honoured.possible(asked, clearance)
    assert np.flatnonzero(~kept.touch[:, back]).tolist() == [3, 4]
    np.testing.assert_array_equal(kept.stay, kept.touch)


def test_what_comes_to_rest_in_the_first_frame_is_still_in_it() -> None:
    asked = wishes.targets((ContactWish("back", "auto", ((0.3, 0.6),)),), TIMES)
    assert asked is not None
    back = names().index("back")
    touches, speed = np.ones((11, 11), bool), np.zeros((11, 11))
    speed[3, back] = 5.0
    (stays,) = honoured.honoured(asked, touches, speed)
    assert stays.share == 1.0
    speed[4, back] = 5.0  # it goes on
    (stays,) = honoured.honoured(asked, touches, speed)
    assert np.flatnonzero(~stays.held[stays.asked]).tolist() == [0, 1]
