"""Train the shape network: ``python -m training.shape --out FILE [--all]``.

It turns the silhouette of a hand into 48 numbers that lie close for one gesture, whoever shows it,
and apart for others: supervised contrastive learning (P. Khosla et al., NeurIPS 2020). Without
``--all`` the kept-aside rooms and people are left out, so that figures can be measured on them;
``--sources`` leaves whole kinds of gestures out, to see how it does on gestures it never saw.
"""

import argparse
import logging
from pathlib import Path
from typing import NamedTuple, cast

import cv2
import numpy as np
import torch
import torch.nn.functional as F
from numpy.typing import NDArray
from torch import Tensor, nn

from app.config import MatchSettings
from app.pipeline.features import Features
from training.export import export
from training.silhouettes import (
    HEIGHT,
    WIDTH,
    Silhouette,
    Vary,
    by_network,
    by_threshold,
    from_renderer,
)

log = logging.getLogger("training.shape")

SEED = 7
NUMBERS = 48
STEPS = 3000
TEMPERATURE = 0.1
VARIED = 40
"""Variants of each silhouette, made once."""


class ShapeNet(nn.Module):
    """(v, 1, 40, 30) squashed signed distances to (v, 48) of length 1."""

    def __init__(self, channels: tuple[int, int, int] = (24, 48, 64)) -> None:
        super().__init__()

        def block(inputs: int, outputs: int, stride: int, size: int = 3) -> list[nn.Module]:
            return [
                nn.Conv2d(inputs, outputs, size, stride=stride, padding=size // 2, bias=False),
                nn.BatchNorm2d(outputs),
                nn.ReLU(),
            ]

        first, second, third = channels
        self.layers = nn.Sequential(
            *block(1, first, 2, 5),
            *block(first, second, 2),
            *block(second, second, 1),
            *block(second, third, 2),
            nn.Flatten(),
            nn.Dropout(0.2),
            nn.Linear(third * 20, NUMBERS),
        )

    def forward(self, views: Tensor) -> Tensor:
        """Numbers of length 1."""
        return F.normalize(cast(Tensor, self.layers(views)), dim=1)


class Source(NamedTuple):
    """Gestures that may be held against one another.

    ``rows`` are (n, 40, 30) float16; ``gestures`` are their indices, gesture by gesture; a batch
    takes ``classes`` gestures and ``each`` rows of them.
    """

    rows: NDArray[np.float16]
    gestures: list[NDArray[np.intp]]
    classes: int
    each: int


def source(silhouettes: list[Silhouette], classes: int, each: int, seed: int) -> Source:
    """Vary the silhouettes and compute what the network sees of them."""
    vary = Vary(seed)
    rows = np.stack([vary(s.mask) for s in silhouettes for _ in range(VARIED)])
    names = np.repeat([s.gesture for s in silhouettes], VARIED)
    features = Features(MatchSettings(features="distance"))
    squashed = features(rows).reshape(-1, HEIGHT, WIDTH).astype(np.float16)
    gestures = [np.flatnonzero(names == name) for name in np.unique(names)]
    return Source(squashed, gestures, min(classes, len(gestures)), each)


def contrastive(numbers: Tensor, gestures: Tensor) -> Tensor:
    """Mean over anchors of ``-mean_p log(exp(a.p/t) / sum_n exp(a.n/t))`` (equation 2, L_out)."""
    alike = numbers @ numbers.T / TEMPERATURE
    itself = torch.eye(len(gestures), dtype=torch.bool)
    alike = alike.masked_fill(itself, -1e9)
    same = (gestures[:, None] == gestures[None]) & ~itself
    share = alike - torch.logsumexp(alike, 1, keepdim=True)
    return cast(Tensor, -(share * same).sum(1).div(same.sum(1)).mean())


def gather(data: Path, names: list[str], held: bool | None) -> list[Source]:
    """The sources; hands seen in a mirror are gestures of a source of their own."""
    found = []
    if "digits" in names:
        found.append((by_threshold(data, held=held), 10, 12))
        found.append((by_network(data / "digits", held=held), 10, 10))
    if "webcam" in names:
        found.append((by_network(data / "webcam-box", held=held), 6, 16))
    mirrored = [
        (
            [Silhouette(np.ascontiguousarray(s.mask[:, ::-1]), s.gesture) for s in ones],
            classes,
            each,
        )
        for ones, classes, each in found
    ]
    found += mirrored
    if "drawn" in names:
        found.append((from_renderer(400, 3, SEED), 24, 4))
    return [source(*one, seed=SEED + number) for number, one in enumerate(found)]


def train(sources: list[Source], steps: int) -> ShapeNet:
    """Train from scratch."""
    torch.manual_seed(SEED)
    rng = np.random.default_rng(SEED)
    network = ShapeNet()
    optimiser = torch.optim.AdamW(network.parameters(), 2e-3, weight_decay=2e-3)
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, 3e-3, steps)
    mean = 0.0
    for step in range(1, steps + 1):
        losses = []
        for one in sources:
            chosen = rng.choice(len(one.gestures), one.classes, replace=False)
            index = np.concatenate([rng.choice(one.gestures[g], one.each) for g in chosen])
            rows = torch.from_numpy(one.rows[index].astype(np.float32))[:, None]
            gestures = torch.arange(one.classes).repeat_interleave(one.each)
            losses.append(contrastive(network(rows), gestures))
        value = torch.stack(losses).mean()
        optimiser.zero_grad(set_to_none=True)
        value.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        schedule.step()
        mean += (value.item() - mean) / min(step, 100)
        if step % 250 == 0:
            log.info("step %d loss %.3f", step, mean)
    return network


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the photographs")
    parser.add_argument("--all", action="store_true", help="nothing is kept aside: for shipping")
    parser.add_argument("--sources", default="digits,webcam,drawn")
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--out", type=Path, required=True, help="ONNX file to write")
    args = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    torch.set_num_threads(1)
    cv2.setNumThreads(0)
    held = None if args.all else False
    sources = gather(args.data, args.sources.split(","), held)
    network = train(sources, args.steps)
    torch.save(network.state_dict(), args.out.with_suffix(".pt"))
    dynamic = {"input": {0: "views"}, "output": {0: "views"}}
    export(network, torch.zeros((1, 1, HEIGHT, WIDTH)), args.out, dynamic)


if __name__ == "__main__":
    main()
