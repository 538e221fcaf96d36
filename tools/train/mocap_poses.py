"""Joint rotations on our skeleton from the CMU archive (ASF/AMC and BVH) and DeepMimic's clips.

Every source gives world orientations S_b of its own bones. Ours are R_b = M S_b A_b Mᵀ with M from the
file's axes to ours and A_b the orientation of the bone in our T-pose:

- ASF/AMC: the zero pose is a T-pose with legs 20° apart, and elbows whose hinges are 30° off the vertical;
  A_b undoes both, as read from the axes in the file.
- BVH of the CMU archive: retargeted to a character whose bones have axes of their own; A_b is the mean over
  the clips that the archive holds in both formats.

Pronation turns our elbow, so the hand's twist about the forearm goes there. The markers of a head sit where
they were stuck, so each subject's head is turned by the constant that makes it upright while the person
stands, and wrists and ankles by those that give all subjects the same mean; neck and head share what is
between chest and head, for the archive splits it differently by subject. Joint angles follow as q_b =
rest_b⁻¹ R_parent⁻¹ R_b.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from simrecon import body as bodies
from simrecon import kinematics, plan, prior
from simrecon.evidence.content import open_content
from simrecon.evidence.mocap import hierarchy
from simrecon.geometry import rotations
from simrecon.types import Array, Evidence, Scene

RATE_HZ = 30.0
AMC_HZ = 120.0
_TO_OURS = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""ASF has x left, y up, z forward; we have x forward, y left, z up."""

# Our segment, the ASF bone whose orientation it has, the BVH joint.
_LIMBS = (("hip", "femur", "Thigh"), ("knee", "tibia", "Calf"), ("ankle", "foot", "Foot"),
          ("shoulder", "humerus", "Upperarm"), ("elbow", "radius", "Forearm"),
          ("wrist", "hand", "Hand"))  # fmt: skip
BONES = {"pelvis": ("root", "Pelvis"), "spine": ("lowerback", "Waist"), "chest": ("thorax", "Spine02"),
         "neck": ("lowerneck", "NeckTwist01"), "head": ("head", "Head")} | {
    f"{side}_{ours}": (f"{side[0]}{asf}", f"{side[0].upper()}_{cc}")
    for side in ("left", "right") for ours, asf, cc in _LIMBS}  # fmt: skip


@dataclass(frozen=True, eq=False)
class MocapClip:
    """Poses of one recording.

    Attributes:
        name: `subject_clip`, the same for both formats of a recording.
        source: `amc`, `bvh` or `deepmimic`.
        joints: (T, 16, 4) quaternions at 30 Hz as they stand in `qpos`.
        world: (T, 17, 4) orientations of the segments, T-pose = identity.
    """

    name: str
    source: str
    joints: Array
    world: Array

    @property
    def subject(self) -> str:
        """Who moved."""
        return self.name.split("_")[0]


@dataclass(frozen=True, eq=False)
class _Bone:
    """One bone of an ASF file: parent's name, C (3, 3), direction (3,), degrees of freedom."""

    parent: str
    axis: Array
    direction: Array
    dof: tuple[str, ...]


_ROW = {name: i for i, name in enumerate(bodies.template().names)}


def read_cmu(folder: Path) -> list[MocapClip]:
    """All clips of the unpacked archive, `cmu_amc` and `cmu_bvh` in `folder`."""
    amc = [_amc(path) for path in sorted(folder.glob("cmu_amc/*/*.amc"))]
    bones = {name: bone for name, (_, bone) in BONES.items()}
    loose = {_name(path): _bvh_orientations(path, bones) for path in sorted(folder.glob("cmu_bvh/*/*.bvh"))}
    world, bind = _calibrate(dict(amc), loose)
    turns = [(name, "amc", turned) for name, turned in amc]
    for name, turned in loose.items():
        turns.append((name, "bvh", rotations.multiply(rotations.multiply(world, turned), bind)))
    groups: dict[tuple[str, str], list[Array]] = {}
    for name, source, turned in turns:
        groups.setdefault((name[:2], source), []).append(turned)
    heads = {group: _head_offset(np.concatenate(parts)) for group, parts in groups.items()}
    return _centred(
        [clip(name, source, _anatomical(w, heads[name[:2], source])) for name, source, w in turns]
    )


def read_mass(folder: Path) -> list[MocapClip]:
    """The BVH clips of MASS: their zero pose is our T-pose, but for axes; only the chest bends."""
    bones = {"pelvis": "Hips", "spine": "Spine", "chest": "Spine1", "neck": "Neck", "head": "Head"}
    parts = ("UpLeg", "Leg", "Foot", "Arm", "ForeArm", "Hand")
    for side in ("Left", "Right"):
        bones |= {
            f"{side.lower()}_{ours}": side + part for (ours, _, _), part in zip(_LIMBS, parts, strict=True)
        }
    clips = []
    for path in sorted(folder.glob("*.bvh")):
        world = _to_ours(_bvh_orientations(path, bones))
        half = np.full(len(world), 0.5)
        world[:, _ROW["spine"]] = rotations.slerp(world[:, _ROW["pelvis"]], world[:, _ROW["chest"]], half)
        clips.append(clip(f"mass_{path.stem}", "bvh", _anatomical(world, np.array([1.0, 0, 0, 0]))))
    return clips


def read_keyframes(folder: Path) -> list[MocapClip]:
    """CMU's acrobatics as points by frame (MuJoCo MPC), fitted like a 3D estimate; wrists and head rest.

    The clip that the archive holds too is left out.
    """
    names = tuple(re.findall(r'<body name="mocap\[(\w+)\]" mocap', (folder / "task.xml").read_text()))
    ours = {"hand": "wrist"}
    points = tuple(
        name if name in ("pelvis", "head")
        else f"{ {'l': 'left', 'r': 'right'}[name[0]]}_{ours.get(name[1:], name[1:])}"
        for name in names
    )  # fmt: skip
    settings = replace(
        plan.read("default").kinematics,
        contact=0.0, penetration=0.0, balance=0.0, still=0.0, joint_scale_m=0.03, evaluations=400,
    )  # fmt: skip
    clips = []
    unseen = [_ROW[name] - 1 for name in ("head", "left_wrist", "right_wrist")]
    for path in sorted(folder.glob("CMU-*.xml")):
        subject, number = path.stem.split("-")[-1].split("_")[:2]
        if f"{int(subject):02d}_{int(number):02d}" == "02_04":
            continue
        rows = re.findall(r'mpos="([^"]+)"', path.read_text())
        joints = np.array([row.split() for row in rows], float).reshape(len(rows), -1, 3)
        evidence = Evidence(
            times_s=np.arange(len(joints)) / RATE_HZ,
            keypoint_names=(), keypoints_px=np.empty((len(joints), 0, 2)), scores=np.empty((len(joints), 0)),
            joint_names=points, joints_m=joints, joints_frame="world",
        )  # fmt: skip
        qpos = kinematics.fit(evidence, Scene(), settings).qpos
        joints = qpos[:, 7:].reshape(len(qpos), 16, 4).copy()
        joints[:, unseen] = rotations.exp(prior.gaussian(bodies.template()).mean_rad[unseen])
        clips.append(
            MocapClip(f"{int(subject):02d}_{int(number):02d}", "points", joints, np.empty((len(qpos), 17, 4)))
        )
    return clips


def _standing(world: Array) -> NDArray[np.bool_]:
    """Frames (T,) of orientations (T, 17, 4) in which pelvis and chest are upright."""
    up = rotations.rotate(world, np.array([0.0, 0.0, 1.0]))[..., 2]  # (T, 17)
    return (up[:, _ROW["pelvis"]] > 0.95) & (up[:, _ROW["chest"]] > 0.9)


def _head_offset(world: Array) -> Array:
    """Rotation (4,) to be put after a head's orientations: upright, and ahead, where the person stands."""
    still = world[_standing(world)]
    ahead = rotations.rotate(still[:, _ROW["chest"]], np.array([1.0, 0.0, 0.0]))
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    upright = rotations.exp(yaw[:, None] * np.array([0.0, 0.0, 1.0]))
    return _mean(rotations.multiply(rotations.conjugate(still[:, _ROW["head"]]), upright), (0,))


def _centred(clips: list[MocapClip]) -> list[MocapClip]:
    """Wrists and ankles turned, by subject and format, to the mean of all subjects while standing.

    Their markers sit where they were stuck; medians of wrists differ by up to 70° between subjects.
    """
    rows = [i for i, name in enumerate(bodies.template().names[1:]) if name.endswith(("_wrist", "_ankle"))]
    groups: dict[tuple[str, str], list[Array]] = {}
    for one in clips:
        groups.setdefault((one.subject, one.source), []).append(one.joints[_standing(one.world)][:, rows])
    means = {group: _mean(np.concatenate(parts), (0,)) for group, parts in groups.items()}  # (4, 4)
    rotvecs = np.array([rotations.log(mean) for mean in means.values()])  # (G, 4, 3)
    side = np.array([-1.0, 1.0, -1.0])
    pair = [rows.index(i) for i in (_other(row) for row in rows)]
    both = np.concatenate((rotvecs, rotvecs[:, pair] * side))
    middle = rotations.exp(np.median(both, axis=0))
    centred = []
    for one in clips:
        joints = one.joints.copy()
        turn = rotations.multiply(rotations.conjugate(means[one.subject, one.source]), middle)
        joints[:, rows] = rotations.canonical(rotations.multiply(joints[:, rows], turn))
        centred.append(replace(one, joints=joints))
    return centred


def _other(row: int) -> int:
    """The joint on the other side."""
    names = bodies.template().names[1:]
    swap = {"left": "right", "right": "left"}
    side, _, rest = names[row].partition("_")
    return names.index(f"{swap[side]}_{rest}") if side in swap else row


def _anatomical(world: Array, head: Array) -> Array:
    """Orientations (T, 17, 4) with an upright head, a neck halfway, and pronation in the elbow."""
    row, world = _ROW, world.copy()
    world[:, row["head"]] = rotations.multiply(world[:, row["head"]], head)
    half = np.full(len(world), 0.5)
    world[:, row["neck"]] = rotations.slerp(world[:, row["chest"]], world[:, row["head"]], half)
    for side in ("left", "right"):
        elbow, hand = row[f"{side}_elbow"], row[f"{side}_wrist"]
        bent = rotations.multiply(rotations.conjugate(world[:, elbow]), world[:, hand])
        twist = rotations.canonical(bent * np.array([1.0, 0.0, 1.0, 0.0]))  # about y, along the forearm
        world[:, elbow] = rotations.multiply(world[:, elbow], twist)
    return world


def clip(name: str, source: str, world: Array) -> MocapClip:
    """From orientations (T, 17, 4)."""
    skeleton = bodies.template()
    parents = skeleton.parents[1:]
    relative = rotations.multiply(rotations.conjugate(world[:, parents]), world[:, 1:])
    joints = rotations.multiply(rotations.conjugate(skeleton.rest[1:]), relative)
    return MocapClip(name, source, rotations.canonical(joints), world)


def _name(path: Path) -> str:
    subject, clip = path.stem.split("_")
    return f"{int(subject):02d}_{int(clip):02d}"


def _asf(path: Path) -> dict[str, _Bone]:
    """Bones of a skeleton file, parents before children."""
    bones: dict[str, _Bone] = {}
    parents: dict[str, str] = {}
    section, entry = "", dict[str, list[str]]()
    for line in path.read_text().splitlines():
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0].startswith(":"):
            section = words[0]
        elif section == ":bonedata":
            if words[0] == "end":
                degrees = [float(word) for word in entry["axis"][:3]]
                bones[entry["name"][0]] = _Bone(
                    "",
                    Rotation.from_euler(entry["axis"][3].lower(), degrees, degrees=True).as_matrix(),
                    np.array([float(word) for word in entry["direction"]]),
                    tuple(entry.get("dof", ())),
                )
            entry = {} if words[0] == "begin" else entry | {words[0]: words[1:]}
        elif section == ":hierarchy" and words[0] not in ("begin", "end"):
            parents |= dict.fromkeys(words[1:], words[0])
    return {
        name: _Bone(parent, bones[name].axis, bones[name].direction, bones[name].dof)
        for name, parent in parents.items()
    }


def _amc(path: Path) -> tuple[str, Array]:
    """Name and orientations (T, 17, 4) of one AMC clip with the ASF file beside it."""
    bones = _asf(next(path.parent.glob("*.asf")))
    rows: dict[str, list[list[float]]] = {}
    for line in path.read_text().splitlines():
        words = line.split()
        if len(words) > 1 and not words[0].startswith(("#", ":")):
            rows.setdefault(words[0], []).append([float(word) for word in words[1:]])
    step = round(AMC_HZ / RATE_HZ)
    values = {name: np.array(row)[::step] for name, row in rows.items()}
    world = {"root": Rotation.from_euler("xyz", values["root"][:, 3:], degrees=True)}
    frames = len(values["root"])
    for name, bone in bones.items():
        turn = Rotation.identity(frames)
        if name in values:
            letters = "".join(letter[1] for letter in bone.dof)
            turn = Rotation.from_euler(letters, values[name].reshape(frames, -1), degrees=True)
        axis = Rotation.from_matrix(bone.axis)
        world[name] = world[bone.parent] * axis * turn * axis.inv()
    stack = []
    for ours, (asf, _) in BONES.items():
        orientation = world[asf]
        if ours == "spine":  # between the two bones below the chest
            between = world["lowerback"].inv() * world["upperback"]
            orientation = orientation * Rotation.from_rotvec(0.5 * between.as_rotvec())
        local = (orientation * _zero_pose(ours, asf, bones)).as_matrix()  # (T, 3, 3)
        stack.append(rotations.from_matrix(_TO_OURS @ local @ _TO_OURS.T))
    order = {name: i for i, name in enumerate(BONES)}
    return _name(path), np.stack([stack[order[n]] for n in bodies.template().names], axis=1)


def _zero_pose(ours: str, asf: str, bones: dict[str, _Bone]) -> Rotation:
    """A_b: orientation, in the file's axes, that the bone has in our T-pose."""
    part = ours.split("_")[-1]
    if part in ("hip", "knee", "ankle"):  # thigh and shank hang straight in our T-pose
        x, y, _ = bones[f"{asf[0]}femur"].direction
        return Rotation.from_euler("z", np.arctan2(x, -y))
    if part in ("shoulder", "elbow"):  # the hinge of the elbow is vertical
        hinge = bones[f"{asf[0]}radius"].axis[:, 0]
        up = hinge * np.sign(hinge[1])
        return Rotation.from_euler("x", np.arctan2(up[2], up[1]))
    return Rotation.identity()


def _to_ours(world: Array) -> Array:
    """Orientations from axes x left, y up, z forward to ours, bones included."""
    turn = rotations.from_matrix(_TO_OURS)
    return rotations.multiply(rotations.multiply(turn, world), rotations.conjugate(turn))


def _bvh_orientations(path: Path, bones: dict[str, str]) -> Array:
    """World orientations (T, 17, 4) of the character's bones at 30 Hz, in the file's axes."""
    joints, interval_s, values = hierarchy.parse(open_content(path))
    step = round(1 / (RATE_HZ * interval_s))
    values = values[::step]
    world: list[Rotation] = []
    column = 0
    for joint in joints:
        before = world[joint.parent] if joint.parent >= 0 else Rotation.identity(len(values))
        axes = [name[0] for name in joint.channels if name.endswith("rotation")]
        own = [column + i for i, name in enumerate(joint.channels) if name.endswith("rotation")]
        column += len(joint.channels)
        # intrinsic rotations: the first channel is the outermost
        world.append(
            before * Rotation.from_euler("".join(axes), values[:, own], degrees=True) if axes else before
        )
    index = {re.sub(r"^(CC_Base|Character\d)_", "", joint.name): i for i, joint in enumerate(joints)}
    stack = [world[index[bones[name]]].as_quat(scalar_first=True) for name in bodies.template().names]
    return rotations.canonical(np.stack(stack, axis=1))


def _calibrate(known: dict[str, Array], loose: dict[str, Array]) -> tuple[Array, Array]:
    """World rotation (4,) and A (17, 4) with known ≈ world ⊗ loose ⊗ A over the clips that both have."""
    pairs = [(known[name], loose[name]) for name in sorted(set(known) & set(loose))]
    count = [min(len(a), len(b)) for a, b in pairs]
    target = np.concatenate([a[:n] for (a, _), n in zip(pairs, count, strict=True)])
    source = np.concatenate([b[:n] for (_, b), n in zip(pairs, count, strict=True)])
    world = np.array([1.0, 0, 0, 0])
    for _ in range(50):
        moved = rotations.multiply(world, source)
        bind = _mean(rotations.multiply(rotations.conjugate(moved), target), (0,))
        world = _mean(
            rotations.multiply(target, rotations.conjugate(rotations.multiply(source, bind))), (0, 1)
        )
    return world, bind


def _mean(q: Array, axes: tuple[int, ...]) -> Array:
    """Chordal mean of quaternions over axes (Markley 2007), robust by one round of weights."""
    weight = np.ones(q.shape[:-1])
    for _ in range(3):
        outer = np.sum(weight[..., None, None] * q[..., :, None] * q[..., None, :], axis=axes)
        mean = np.linalg.eigh(outer)[1][..., -1]  # (..., 4)
        weight = 1 / (0.1 + rotations.angle_between(q, np.broadcast_to(mean, q.shape))) ** 2
    return rotations.canonical(mean)
