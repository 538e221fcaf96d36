"""Train ψ(β), the primitives of a shape (models/body/primitives.npz), after Gärtner 2022, appendix A.

The paper fits eq. 9 to 50,000 sampled shapes and trains a network on the pairs. Here the network, of the
same size, is trained on eq. 9 itself: every step samples new shapes and lowers the equation's value at the
network's output, so no fit stands between the two. It starts from the direct fit (`simrecon.body.fitting`) of
the mean shape. The distance of a primitive's point to the skin is that to the plane of the nearest vertex or
face centre, within the area that stands for it. `tools.train.evaluate_primitives` compares the result with
direct fits on shapes that were not used.

usage: python -m tools.train.primitives [--seconds 540] [--shapes 300000] [--state FILE]        (needs torch)
"""

from __future__ import annotations

import argparse
import io
import time
from pathlib import Path
from typing import Any

import numpy as np
import torch

from simrecon.body import fitting, pieces, shape, sizes, targets
from simrecon.body.skeleton import template
from simrecon.io import atomic
from tools import CHECKOUT

TARGET = CHECKOUT / "models" / "body" / "primitives.npz"
BATCH, SIGMA, RATE = 32, 1.2, 1e-3
AROUND, ALONG, RINGS, CELLS = 8, 4, 2, 3


def main() -> None:
    """Train for a while, from where an earlier run stopped; write the network at the end."""
    parser = argparse.ArgumentParser(description="Train models/body/primitives.npz.")
    parser.add_argument("--seconds", type=float, default=540.0, help="of this run [%(default)s]")
    parser.add_argument("--shapes", type=int, default=300000, help="of all runs together [%(default)s]")
    parser.add_argument("--state", type=Path, default=Path("train_primitives.pt"), help="kept between runs")
    options = parser.parse_args()
    torch.set_num_threads(1)
    space, steps = shape.space(), options.shapes // BATCH
    net, optimiser = _network(space.size)
    segments = _segments(space)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimiser, steps, RATE / 100)
    done = 0
    if options.state.is_file():
        kept = torch.load(options.state, weights_only=True)
        net.load_state_dict(kept["net"])
        optimiser.load_state_dict(kept["optimiser"])
        schedule.load_state_dict(kept["schedule"])
        schedule.T_max = steps  # the rate still ends low where `--shapes` has changed
        done = kept["done"]
    begin, shown = time.perf_counter(), []
    while done < steps and time.perf_counter() - begin < options.seconds:
        rng = np.random.default_rng([7, done])
        betas = np.clip(rng.normal(0, SIGMA, (BATCH, space.size)), -shape.BETA_MAX, shape.BETA_MAX)
        psi = net(torch.as_tensor(betas, dtype=torch.float32))
        loss = _eq9(psi, space, segments, betas)
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(net.parameters(), 0.2)
        optimiser.step()
        schedule.step()
        done += 1
        shown.append(loss.item())
        if done % 200 == 0:
            print(f"{done * BATCH} shapes, {np.mean(shown[-200:]) * 500:.3f} mm a segment, "
                  f"{time.perf_counter() - begin:.0f} s", flush=True)  # fmt: skip
    torch.save(
        {
            "net": net.state_dict(),
            "optimiser": optimiser.state_dict(),
            "schedule": schedule.state_dict(),
            "done": done,
        },
        options.state,
    )
    _write(net, done * BATCH)


def _network(betas: int) -> tuple[torch.nn.Sequential, torch.optim.Adam]:
    torch.manual_seed(0)
    first = fitting.fit(
        targets.of_shape(shape.space(), np.zeros(betas)), fitting.start(shape.stature_m(np.zeros(betas)))
    )
    net = torch.nn.Sequential(
        torch.nn.Linear(betas, 256), torch.nn.ReLU(), torch.nn.Linear(256, 256), torch.nn.ReLU(),
        torch.nn.Linear(256, len(first)),
    )  # fmt: skip
    with torch.no_grad():
        net[4].weight *= 0.02
        net[4].bias[:] = torch.as_tensor(first)
    return net, torch.optim.Adam(net.parameters(), lr=RATE)


def _segments(space: shape.ShapeSpace) -> list[dict[str, Any]]:
    """What stays the same for all shapes, by segment."""
    layout, names = sizes.layout(), template().names
    mean = space.vertices_m(np.zeros(space.size))
    area = pieces.vertex_areas(mean, space.faces)
    segments = []
    for piece in pieces.cut(space.faces, space.weights.argmax(axis=1)).values():
        name = names[piece.segment]
        rows = [i for i, segment in enumerate(layout.segments) if segment == name]
        if not rows:
            continue
        origins, axes = space.frames(np.zeros(space.size))
        local = (mean - origins[piece.segment]) @ axes[piece.segment]
        folded = not name.startswith("left_")
        own = piece.own[local[piece.own, 1] > -1e-6] if folded else piece.own
        segments.append(
            {
                "piece": piece, "rows": rows, "folded": folded, "own": own,
                "weights": torch.as_tensor(area[own] / area[own].sum(), dtype=torch.float32),
                "matrix": torch.as_tensor(layout.matrix[rows], dtype=torch.float32),
                "kinds": [layout.kinds[i] for i in rows], "central": [layout.central[i] for i in rows],
            }
        )  # fmt: skip
    return segments


def _eq9(
    psi: torch.Tensor, space: shape.ShapeSpace, segments: list[dict[str, Any]], betas: np.ndarray
) -> Any:
    """Mean over shapes and segments of eq. 9 (both directions together), m."""
    lower = torch.as_tensor(sizes.layout().lower, dtype=torch.float32)
    below = (lower - psi).clamp_min(0).sum(dim=1).mean()  # pulls radii back into their bounds
    psi = torch.maximum(psi, lower)
    skin = space.vertices_m(betas)  # (B, V, 3)
    origins, axes = space.frames(betas)
    total = torch.zeros(())
    for part in segments:
        s = part["piece"].segment
        local = (skin - origins[:, None, s]) @ axes[:, s]  # (B, V, 3)
        own = torch.as_tensor(local[:, part["own"]], dtype=torch.float32)
        surface = _surface(part["piece"], local)
        values = torch.einsum("evs,bs->bev", part["matrix"], psi)
        signed = torch.stack(
            [_distance(kind, values[:, e], own) for e, kind in enumerate(part["kinds"])], dim=1
        )  # (B, e, n)
        total = total + (signed.min(dim=1).values.abs() * part["weights"]).sum(dim=1).mean()
        total = total + _back(part, values, *surface).mean()
    return total / len(segments) + below


def _surface(piece: pieces.Piece, local: np.ndarray) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Points (B, N, 3) on a piece, unit normals, and the radius (B, N) of the disc that each stands for."""
    vertices = torch.as_tensor(piece.vertices(local), dtype=torch.float32)
    faces = torch.as_tensor(piece.faces)
    a, b, c = (vertices[:, faces[:, k]] for k in range(3))
    cross = torch.linalg.cross(b - a, c - a)
    area = cross.norm(dim=-1) / 2
    normal = torch.zeros_like(vertices)
    at_vertex = torch.zeros(vertices.shape[:2])
    real = torch.as_tensor(~piece.fans, dtype=torch.float32)[:, None]
    for k in range(3):
        normal.index_add_(1, faces[:, k], cross * real)
        at_vertex.index_add_(1, faces[:, k], area / 6)
    fan = torch.as_tensor(np.flatnonzero(piece.fans))
    rim, hub = (a[:, fan] + b[:, fan]) / 2, c[:, fan]
    points = [vertices, (a + b + c) / 3, 0.75 * rim + 0.25 * hub, 0.25 * rim + 0.75 * hub]
    normals = [normal, cross, cross[:, fan], cross[:, fan]]
    radii = [at_vertex, area / 2, area[:, fan] / 3, area[:, fan] / 6]
    unit = torch.cat(normals, dim=1)
    unit = unit / unit.norm(dim=-1, keepdim=True).clamp_min(1e-12)
    return torch.cat(points, dim=1), unit, (torch.cat(radii, dim=1) / torch.pi).sqrt()


def _distance(kind: str, values: torch.Tensor, points: torch.Tensor) -> torch.Tensor:
    """Signed distance (B, n) of points (B, n, 3) to primitives (B, 9)."""
    if kind == "capsule":
        a, b = values[:, None, :3], values[:, None, 3:6]
        axis = b - a
        share = ((points - a) * axis).sum(-1, keepdim=True) / (axis * axis).sum(-1, keepdim=True).clamp_min(
            1e-9
        )
        away = points - a - share.clamp(0, 1) * axis
        return (away.square().sum(-1) + 1e-12).sqrt() - values[:, None, 6]
    beyond = (points - values[:, None, :3]).abs() - values[:, None, 6:]
    out = (beyond.clamp_min(0).square().sum(-1) + 1e-12).sqrt()
    return torch.where((beyond > 0).any(-1), out, beyond.max(-1).values)


def _samples(kind: str, values: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Points (B, P, 3) on primitives (B, 9) and areas (B, P), as `simrecon.body.surface.samples`."""
    if kind == "box":
        grid = (torch.arange(CELLS) + 0.5) / CELLS * 2 - 1
        u, v = (x.ravel() for x in torch.meshgrid(grid, grid, indexing="ij"))
        unit, axis = [], []
        for k in range(3):
            for sign in (-1.0, 1.0):
                face = torch.zeros(len(u), 3)
                face[:, k], face[:, (k + 1) % 3], face[:, (k + 2) % 3] = sign, u, v
                unit.append(face)
                axis += [k] * len(u)
        half = values[:, 6:]
        area = (half.prod(dim=1, keepdim=True) / half)[:, axis]
        return values[:, None, :3] + torch.cat(unit) * half[:, None], area
    turn = torch.arange(AROUND) * 2 * torch.pi / AROUND
    ring = torch.stack((turn.cos(), turn.sin(), torch.zeros(AROUND)), dim=-1)
    share, normal, flat = [], [], []
    for k in range(ALONG):
        share += [(k + 0.5) / ALONG] * AROUND
        normal.append(ring)
        flat += [1.0] * AROUND
    for end in (0.0, 1.0):
        for k in range(RINGS):
            z = (k + 0.5) / RINGS
            share += [end] * AROUND
            normal.append(
                torch.cat((ring[:, :2] * (1 - z * z) ** 0.5, torch.full((AROUND, 1), z * (2 * end - 1))), 1)
            )
            flat += [0.0] * AROUND
    t, cylinder = torch.tensor(share)[:, None], torch.tensor(flat)
    a, b, radius = values[:, :3], values[:, 3:6], values[:, 6:7]
    length = ((b - a).square().sum(-1, keepdim=True) + 1e-12).sqrt()
    u = (b - a) / length
    reference = torch.eye(3)[u.detach().abs().argmin(dim=1)]
    e1 = torch.nn.functional.normalize(torch.linalg.cross(u, reference), dim=-1)
    frame = torch.stack((e1, torch.linalg.cross(u, e1), u), dim=1)  # (B, 3, 3)
    n = torch.cat(normal) @ frame
    area = (
        2 * torch.pi * radius * length * cylinder / cylinder.sum()
        + 4 * torch.pi * radius**2 * (1 - cylinder) / (1 - cylinder).sum()
    )
    return a[:, None] + t * (b - a)[:, None] + radius[:, None] * n, area


def _back(
    part: dict[str, Any],
    values: torch.Tensor,
    points: torch.Tensor,
    normals: torch.Tensor,
    radii: torch.Tensor,
) -> torch.Tensor:
    """Mean distance (B,) of points on the primitives to the piece."""
    places, areas = [], []
    for e, kind in enumerate(part["kinds"]):
        on, area = _samples(kind, values[:, e])
        if part["folded"]:
            on = torch.stack((on[..., 0], on[..., 1].abs(), on[..., 2]), dim=-1)
            area = area * (0.5 if part["central"][e] else 1.0)
        area = area.detach().clone()
        for other, its_kind in enumerate(part["kinds"]):
            if other != e:
                area *= _distance(its_kind, values[:, other].detach(), on.detach()) > 0
        places.append(on)
        areas.append(area)
    on, area = torch.cat(places, dim=1), torch.cat(areas, dim=1)
    near = torch.cdist(on.detach(), points).argmin(dim=2)[..., None].expand(-1, -1, 3)  # (B, P, 3)
    away = on - points.gather(1, near)
    normal = normals.gather(1, near)
    up = (away * normal).sum(-1)
    along = ((away - up[..., None] * normal).square().sum(-1) + 1e-12).sqrt()
    beside = (along - radii.gather(1, near[..., 0])).clamp_min(0)
    far = (up.square() + beside.square() + 1e-10).sqrt()
    return (far * area).sum(1) / area.sum(1).clamp_min(1e-9)


def _write(net: torch.nn.Sequential, shapes: int) -> None:
    arrays = {"schema": np.array(sizes.SCHEMA), "shapes": np.array(shapes)}
    for i, layer in enumerate(net[::2]):
        arrays[f"weight_{i}"] = layer.weight.detach().numpy().T.astype(np.float32)
        arrays[f"bias_{i}"] = layer.bias.detach().numpy().astype(np.float32)
    data = io.BytesIO()
    np.savez_compressed(data, allow_pickle=False, **arrays)
    atomic.write_bytes(TARGET, data.getvalue())
    print(f"{TARGET.name}: {TARGET.stat().st_size // 1000} kB after {shapes} shapes")


if __name__ == "__main__":
    main()
