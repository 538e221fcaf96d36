"""Clips from folders, globs and manifests, and their names."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import pytest

from simrecon import resources
from simrecon.batch import clips, files, survey
from simrecon.errors import InputError
from simrecon.job import Job, Reading, inputs
from simrecon.types import Ground, Scene
from tools import CHECKOUT


def touch(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()


def test_a_folder_gives_its_inputs_and_nothing_else(tmp_path: Path) -> None:
    touch(
        tmp_path, "b.npz", "a.bvh", "a.mp4", "film.mp4", "notes.txt", ".hidden.npz", "deep/er/c.pkl", "m.toml"
    )
    touch(tmp_path, "out/batch.jsonl", "out/x/motion.npz", "earlier/report.json", "earlier/motion.npz")
    touch(tmp_path, "op/000_keypoints.json", "op/001_keypoints.json")
    found = clips.collect([str(tmp_path)])
    assert [clip.name for clip in found] == ["a", "b", "deep_er_c", "film", "op"]
    assert found[4].input == str(tmp_path / "op")


def test_globs_and_files(tmp_path: Path) -> None:
    touch(tmp_path, "a.npz", "b.npz", "c.dat")
    found = clips.collect([str(tmp_path / "*.npz"), str(tmp_path / "c.dat"), str(tmp_path / "a.npz")])
    assert [clip.name for clip in found] == ["a", "b", "c"]


def test_clips_of_the_same_name_in_folders_whose_names_are_no_text(tmp_path: Path) -> None:
    places = [os.fsdecode(name) for name in (b"x\xe9", b"y\xe9")]
    touch(tmp_path, *(f"{place}/clip.npz" for place in places))
    found = clips.collect([str(tmp_path / place / "clip.npz") for place in places])
    assert len({clip.name for clip in found}) == 2


def test_clips_of_the_same_name_get_names_of_their_own_that_last(tmp_path: Path) -> None:
    touch(tmp_path, "x/clip.npz", "y/clip.npz", "y/other.npz", "z/CLIP.npz")
    given = [str(tmp_path / name / "*.npz") for name in ("x", "y", "z")]
    names = [clip.name for clip in clips.collect(given)]
    assert len({name.lower() for name in names}) == 4
    assert "other" in names
    assert [clip.name for clip in clips.collect(given[::-1])] != names
    assert {clip.name for clip in clips.collect(given[::-1])} == set(names)


def test_parts_of_one_clip_have_names_of_their_own_and_are_read_as_such(tmp_path: Path) -> None:
    rows = "input,from_s,to_s,every\nbeam.npz,0.2,0.8,\nbeam.npz,0.8,1.2,2\n"
    (tmp_path / "parts.csv").write_text(rows)
    (tmp_path / "beam.npz").write_bytes((resources.folder("example") / "beam.npz").read_bytes())
    first, second = clips.collect([str(tmp_path / "parts.csv")])
    assert first.name != second.name
    assert second.options == {"from_s": 0.8, "to_s": 1.2, "every": 2}
    facts = survey.survey(second)
    assert facts["video_s"] == pytest.approx(0.4)
    assert facts["frames"] == 13
    assert facts["key"] != survey.survey(first)["key"]


def test_scenes_and_videos_are_found_by_name(tmp_path: Path) -> None:
    touch(tmp_path, "in/a.npz", "in/b.npz", "scenes/a.toml", "videos/b.mov")
    a, b = clips.collect(
        [str(tmp_path / "in")], scene_folder=str(tmp_path / "scenes"), video_folder=str(tmp_path / "videos")
    )
    assert (a.scene, a.options.get("video")) == (str(tmp_path / "scenes" / "a.toml"), None)
    assert (b.scene, b.options.get("video")) == (None, str(tmp_path / "videos" / "b.mov"))


def test_a_manifest_of_toml(tmp_path: Path) -> None:
    touch(tmp_path, "a.npz", "in/b.npz", "chair.toml")
    (tmp_path / "night.toml").write_text(
        '[defaults]\nmass_kg = 70\nscene = "chair.toml"\n'
        '[[clip]]\ninput = "a.npz"\nname = "first"\nmass_kg = 60.5\nseed = 3\n'
        '[[clip]]\ninput = "in/*.npz"\nplan = "quick"\nperson = "2"\n'
        '[[clip]]\ninput = "a.npz"\nname = "third"\nperson_at = "640,360"\nmodel = "full"\n',
        encoding="utf-8",
    )
    first, second, third = clips.collect([str(tmp_path / "night.toml")], {"plan": "flips", "fps": 25.0})
    assert (first.name, first.plan) == ("first", "flips")
    assert first.options == {"fps": 25.0, "mass_kg": 60.5, "seed": 3}
    assert (second.name, second.plan) == ("b", "quick")
    assert second.options == {"fps": 25.0, "mass_kg": 70, "person": "2"}
    assert third.options["person_at_px"] == (640.0, 360.0)
    assert third.options["model"] == "full"
    assert first.scene == second.scene == str(tmp_path / "chair.toml")


@pytest.mark.parametrize("rest", ["", ",,\n\n, , \n", ",,,,,\n"])
def test_rows_that_a_spreadsheet_left_empty_are_none(tmp_path: Path, rest: str) -> None:
    case = CHECKOUT / "tests" / "data" / "cases" / "manifest_trailing_row.csv"
    (tmp_path / "bvh_height_1m71.bvh").touch()
    (tmp_path / "night.csv").write_bytes(case.read_bytes() + rest.encode())
    (clip,) = clips.collect([str(tmp_path / "night.csv")])
    assert (clip.plan, clip.options) == ("quick", {"height_m": 1.71})


def test_a_name_that_no_file_can_have_is_one_clear_line() -> None:
    with pytest.raises(InputError, match=r"^x{80}: cannot be looked for: File name too long$"):
        clips.collect(["x" * 5000])


def test_cells_that_a_spreadsheet_left_empty_after_a_row_are_none(tmp_path: Path) -> None:
    touch(tmp_path, "a.npz")
    (tmp_path / "night.csv").write_text("input,mass_kg\na.npz,60,,\n", encoding="utf-8")
    (clip,) = clips.collect([str(tmp_path / "night.csv")])
    assert clip.options == {"mass_kg": 60}


def test_a_manifest_of_csv(tmp_path: Path) -> None:
    touch(tmp_path, "a.npz", "b.npz")
    (tmp_path / "night.csv").write_text("input, mass_kg, up\na.npz, 61,\nb.npz,, -y\n", encoding="utf-8")
    a, b = clips.collect([str(tmp_path / "night.csv")])
    assert (a.options, b.options) == ({"mass_kg": 61}, {"up": "-y"})


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[[clip]]\n", "lacks the key 'input'"),
        (
            '[[clip]]\ninput = "a.npz"\nmas_kg = 3\n',
            "unknown key 'mas_kg', did you mean 'mass_kg'?; valid: name, input",
        ),
        ('[[clip]]\ninput = "a.npz"\nmass_kg = 3\n', "mass_kg must be a number from"),
        ('[[clip]]\ninput = "a.npz"\nseed = 1.5\n', "seed must be a whole number"),
        ('[[clip]]\ninput = "a.npz"\nup = "w"\n', "up must be one of x, y, z"),
        ('[[clip]]\ninput = "a.npz"\nperson_at = "7"\n', "person_at_px must be a list of two numbers"),
        ('[[clip]]\ninput = "a.npz"\nmodel = "big"\n', "model must be one of heavy, full"),
        ('[[clip]]\ninput = "a.npz"\nscene = "none.toml"\n', "scene: found no file"),
        ('[[clip]]\ninput = "a.npz"\nname = "a/b"\n', "valid: a file name such as 'a_b'"),
        ('[[clip]]\ninput = "a.npz"\nname = "x"\n' * 2, "found 2 of that name"),
        ('[[clip]]\ninput = "none.npz"\n', "found no such file"),
        ("[[clips]]\n", "unknown key 'clips'"),
        ("clip = 3\n", "clip must be a list, each a table, found 3"),
        ("clip = []\n", "found no [[clip]]"),
        ("[defaults]\n", "lacks the key 'clip'"),
        ('[defaults]\ninput = "a.npz"\n[[clip]]\nmass_kg = 60\n', "[defaults] input: found one for all"),
        ('[[clip]]\ninput = "a.npz"\nengine = "fast"\n', "engine must be one of sampling, none, found"),
        ('[[clip]]\ninput = "a.npz"\nplan = 3\n', "plan must be text in quotes, found 3"),
        ("not toml", "not valid TOML"),
        ("a = " + 5000 * "[", "not valid TOML: nested too deeply"),
    ],
)
def test_what_is_wrong_in_a_manifest_is_one_line(tmp_path: Path, text: str, words: str) -> None:
    touch(tmp_path, "a.npz")
    (tmp_path / "night.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as raised:
        clips.collect([str(tmp_path / "night.toml")])
    assert words in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["name\nx\n", "input,mass_kg\na.npz,60,70\n", "input,mass_kg\na.npz\n", ""])
def test_what_is_wrong_in_a_table_is_one_line(tmp_path: Path, text: str) -> None:
    touch(tmp_path, "a.npz")
    (tmp_path / "night.csv").write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"night\.csv"):
        clips.collect([str(tmp_path / "night.csv")])


def test_nothing_found_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="found no clip"):
        clips.collect([str(tmp_path)])


def test_what_a_clip_says_replaces_what_it_excludes(tmp_path: Path) -> None:
    touch(tmp_path, "a.npz", "b.npz", "lens.toml", "own.toml")
    text = """[defaults]
    camera_name = "left"
    [[clip]]
    input = "a.npz"
    fov_deg = 50.0
    [[clip]]
    input = "b.npz"
    camera = "own.toml"
    """
    (tmp_path / "night.toml").write_text(text, encoding="utf-8")
    a, b = clips.collect([str(tmp_path / "night.toml")], {"camera": str(tmp_path / "lens.toml")})
    assert a.options == {"fov_deg": 50.0}
    assert b.options == {"camera": str(tmp_path / "own.toml"), "camera_name": "left"}


def test_what_is_said_of_all_clips_is_for_those_for_which_it_has_a_meaning(tmp_path: Path) -> None:
    example = resources.folder("example")
    both = [str(example / "beam.npz"), str(example / "beam.mp4")]
    said = {"model": "lite", "fps": 30.0}
    first, second = clips.collect(both, said)
    assert (first.options, second.options) == ({"fps": 30.0}, {"fps": 30.0, "model": "lite"})
    with pytest.raises(InputError, match="--size: has no meaning for any"):
        clips.collect(both, {"size_px": (640, 480)})  # without a lens
    with pytest.raises(InputError, match="--model: has no meaning for any"):
        clips.collect(both[:1], {"model": "lite"})
    rows = f'[[clip]]\ninput = "{both[0]}"\nname = "a"\n[[clip]]\ninput = "{both[0]}"\nperson = "2"\n'
    (tmp_path / "night.toml").write_text('[defaults]\nperson = "1"\n' + rows, encoding="utf-8")
    a, b = clips.collect([str(tmp_path / "night.toml")])
    assert (a.options, b.options) == ({}, {"person": "2"})  # what a row says is refused when it is read
    with pytest.raises(InputError, match="--person: found '2'"):
        inputs.observe(b.job(tmp_path / "out"))


def test_a_piece_is_not_turned_again() -> None:
    reading = Reading(rotate=90, from_s=1.0)
    whole = Job("clip.npz", "out", reading=reading, video="lying.mp4", scene=Scene(Ground(calibrate=True)))
    piece = survey.of_piece(whole, Path("piece.npz"))
    assert (piece.input, piece.reading, piece.video) == ("piece.npz", Reading(), None)
    assert not piece.scene.ground.calibrate
    upright = replace(whole, reading=Reading(from_s=1.0))
    assert survey.of_piece(upright, Path("piece.npz")).video == "lying.mp4"


@pytest.mark.parametrize(("key", "near"), [("from", "from_s"), ("to", "to_s"), ("evry", "every")])
def test_keys_of_parts_are_suggested(tmp_path: Path, key: str, near: str) -> None:
    (tmp_path / "parts.csv").write_text(f"input,{key}\nclip.npz,2\n", encoding="utf-8")
    with pytest.raises(InputError, match=f"unknown key {key!r}, did you mean {near!r}"):
        clips.collect([str(tmp_path / "parts.csv")])


def test_long_names_are_cut_by_bytes_and_stay_different(tmp_path: Path) -> None:
    for name in ("動" * 80 + "a", "動" * 80 + "b"):
        touch(tmp_path, f"{name}.npz")
    names = [clip.name for clip in clips.collect([str(tmp_path)])]
    assert len(set(names)) == 2
    assert all(len(os.fsencode(name)) <= files.NAME_MAX_BYTES for name in names)


def test_a_name_that_is_no_text_is_a_clip(tmp_path: Path) -> None:
    (tmp_path / os.fsdecode(b"caf\xe9.npz")).touch()
    (clip,) = clips.collect([str(tmp_path)])
    assert clip.name == "caf"
    assert os.fsencode(clip.input).endswith(b"caf\xe9.npz")


@pytest.mark.skipif(os.name == "nt", reason="pipes and links of Unix")
def test_what_is_neither_file_nor_folder_is_one_line(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.npz")
    (tmp_path / "circle.npz").symlink_to("circle.npz")
    (tmp_path / "nowhere.npz").symlink_to("missing.npz")
    for name, found in (("pipe", "a pipe or a device"), ("circle", "a link"), ("nowhere", "a link")):
        for word in (f"{name}.npz", f"{name[:-1]}?.npz"):
            with pytest.raises(InputError, match=rf"{name}\.npz: found {found}"):
                files.find(str(tmp_path / word))
    with pytest.raises(InputError, match="a pipe or a device"):
        files.find(os.devnull)
    for blank in ("", " "):
        with pytest.raises(InputError, match="found the path"):
            files.find(blank)


@pytest.mark.skipif(os.name == "nt", reason="links of Unix")
def test_links_in_a_circle_are_gone_through_once(tmp_path: Path) -> None:
    touch(tmp_path, "in/a.npz", "in/deep/b.npz", "in/.hidden/c.npz")
    for name in ("u", "v", "deep/w"):
        (tmp_path / "in" / name).symlink_to(tmp_path / "in")
    inside = [path.relative_to(tmp_path / "in").as_posix() for path, _ in files.find(str(tmp_path / "in"))]
    assert inside == ["a.npz", "deep/b.npz"]
    found = {path.name for path, _ in files.find(str(tmp_path / "**" / "*.npz"))}
    assert found == {"a.npz", "b.npz"}
    assert {path.name for path, _ in files.find(str(tmp_path / "in" / "deep" / "**"))} >= {"b.npz"}


def test_folders_without_end_are_one_line(tmp_path: Path) -> None:
    touch(tmp_path, "/".join("d" * 210) + "/a.npz")
    with pytest.raises(InputError, match="found folders in more than 200 others"):
        files.find(str(tmp_path))
