"""Mass: de Leva's table, shapes, distributions for retargeting, and what MuJoCo gets."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simrecon import body as bodies
from simrecon import scene as scenes
from simrecon.body import mass
from simrecon.errors import InputError
from simrecon.types import Body, Scene

ARMS = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist"))


def compiled(body: Body) -> mujoco.MjModel:
    """The model that is simulated: MJCF in a scene, written and read again."""
    return mujoco.MjModel.from_xml_string(scenes.build(body.mjcf, Scene(), 0.01))


def person(shaped: bool, mass_kg: float, distribution: str = "standard") -> Body:
    if shaped:
        return bodies.build(betas=np.array([0.5, 1.0]), mass_kg=mass_kg, distribution=distribution)
    tree = bodies.scaled({}, 1.75)
    return bodies.build(tree, height_m=1.75, mass_kg=mass_kg, distribution=distribution)


def share(body: Body, segments: tuple[str, ...]) -> float:
    return sum(part.mass_kg for part in body.primitives if part.segment in segments) / body.mass_kg


@pytest.mark.parametrize("shaped", [False, True])
@pytest.mark.parametrize("mass_kg", [60.0, 45.5, 73.0, 99.99, 146.0, 61.234567, 123.456789])
def test_mass_in_is_mass_in_mujoco(shaped: bool, mass_kg: float) -> None:
    model = compiled(person(shaped, mass_kg))
    assert model.body_mass.sum() == pytest.approx(mass_kg, abs=1.01e-6)
    assert (model.geom_bodyid[model.body_mass[model.geom_bodyid] > 0] > 0).all()


@given(st.lists(st.floats(0.3, 1.0), min_size=4, max_size=4), st.floats(30.0, 200.0))
def test_printable_masses_add_up(light: list[float], total_kg: float) -> None:
    exact = {
        "left_hand": light[0],
        "right_hand": light[0],
        "neck": light[1],
        "face": light[2],
        "left_arm": 2.5 * light[3],
    }
    exact["right_arm"] = exact["left_arm"]
    exact["trunk"] = total_kg - sum(exact.values())
    rounded = mass.printable(exact, total_kg)
    assert sum(rounded.values()) == pytest.approx(total_kg, abs=1.01e-6)
    assert (rounded["left_hand"], rounded["left_arm"]) == (rounded["right_hand"], rounded["right_arm"])
    for name, value in rounded.items():
        assert value == float(f"{value:.6g}")
        assert value == pytest.approx(exact[name], abs=2e-3)


def test_the_mean_shape_has_the_shares_of_de_leva() -> None:
    body = bodies.build(betas=np.zeros(10), mass_kg=70.0)
    percent = mass.data()["percent"]
    whole = sum(percent.values()) + sum(
        percent[p] for p in ("upper_arm", "forearm", "hand", "thigh", "shank", "foot")
    )
    for segment, part in (
        ("left_hip", "thigh"),
        ("left_knee", "shank"),
        ("pelvis", "lower_trunk"),
        ("chest", "upper_trunk"),
    ):
        assert share(body, (segment,)) == pytest.approx(percent[part] / whole, rel=1e-4)


def test_a_broad_trunk_weighs_more() -> None:
    broad, slender = (bodies.build(betas=np.array([0.0, b]), mass_kg=70.0) for b in (2.0, -2.0))
    trunk = ("pelvis", "spine", "chest")
    volumes = [
        sum(
            np.prod(p.size_m) if p.kind == "box" else p.size_m[0] ** 2
            for p in body.primitives
            if p.segment in trunk
        )
        for body in (broad, slender)
    ]
    if volumes[0] < volumes[1]:
        broad, slender = slender, broad
    assert share(broad, trunk) > share(slender, trunk) + 0.01


def test_inertia_is_that_of_the_primitive() -> None:
    body = person(True, 70.0)
    model = compiled(body)
    hand = next(part for part in body.primitives if part.name == "left_hand")
    a, b, c = 2 * hand.size_m
    expected = hand.mass_kg / 12 * np.array([b * b + c * c, a * a + c * c, a * a + b * b])
    inertia = np.sort(model.body_inertia[model.body("left_wrist").id])
    np.testing.assert_allclose(inertia, np.sort(expected), rtol=1e-4)


@pytest.mark.parametrize("shaped", [False, True])
@pytest.mark.parametrize(
    ("name", "mass_kg", "segments", "expected"),
    [("heavy_head", 36.5, ("head",), 0.40), ("heavy_arms", 146.0, ARMS, 0.36)],
)
def test_distributions_for_retargeting(
    shaped: bool, name: str, mass_kg: float, segments: tuple[str, ...], expected: float
) -> None:
    assert mass.distribution(name).mass_kg == mass_kg
    body, usual = person(shaped, mass_kg, name), person(shaped, mass_kg)
    assert share(body, segments) == pytest.approx(expected, abs=1e-5)
    both = zip(body.primitives, usual.primitives, strict=True)
    legs = [part.mass_kg / other.mass_kg for part, other in both if part.segment not in segments]
    np.testing.assert_allclose(legs, legs[0], rtol=1e-4)
    assert compiled(body).body_mass.sum() == pytest.approx(mass_kg, abs=1e-5)


def test_standard_is_what_is_used_without_a_name() -> None:
    assert mass.distribution("standard").mass_kg == 73.0
    assert [part.mass_kg for part in person(False, 73.0, "standard").primitives] == [
        part.mass_kg for part in bodies.build(bodies.scaled({}, 1.75), height_m=1.75, mass_kg=73.0).primitives
    ]


def test_an_unknown_distribution_lists_the_valid_ones() -> None:
    with pytest.raises(InputError, match="found 'top_heavy'; valid: standard, heavy_head, heavy_arms"):
        person(False, 70.0, "top_heavy")
