"""Train the mask network: ``python -m training.mask --stage 1 --work DIR``.

Three stages, each from the weights of the one before. The first sees composed pictures only. The
second adds real pictures that are labelled from landmarks (``training.labels``). Both leave the
kept-aside rooms and people out, so that figures can be measured on them. The third, which is
shipped, goes on with everything.
"""

import argparse
import logging
import time
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import torch
from torch import Tensor, nn
from torch.utils.data import DataLoader, Dataset

from training.compose import Material, sample
from training.drawn import drawn_hands
from training.labels import load
from training.network import MaskNet, loss
from training.photos import backgrounds, digit_hands

log = logging.getLogger("training.mask")

SEED = 7
FRESH = 16
"""Composed a batch; each also comes mirrored and turned by a right angle: 32 in all."""
STEPS = {1: 9000, 2: 4000, 3: 2500}
RATE = {1: 3e-3, 2: 2e-3, 3: 1e-3}
"""Highest learning rate of the one-cycle schedule (L. Smith, N. Topin, 2017)."""
SAVE_EVERY = 250


class Batches(Dataset[tuple[Tensor, Tensor, Tensor]]):
    """Batch ``i`` of a stage: always the same pictures, whichever process composes it."""

    def __init__(self, material: Material, stage: int, steps: int) -> None:
        self._material, self._stage, self._steps = material, stage, steps

    def __len__(self) -> int:
        return self._steps

    def __getitem__(self, index: int) -> tuple[Tensor, Tensor, Tensor]:
        rng = np.random.default_rng((SEED, self._stage, index))
        drawn = [sample(self._material, rng) for _ in range(FRESH)]
        pictures = torch.from_numpy(np.stack([s.picture for s in drawn])).permute(0, 3, 1, 2)
        covers = torch.from_numpy(np.stack([s.cover for s in drawn])[:, None])
        weights = torch.from_numpy(np.stack([s.weight for s in drawn])[:, None])
        turns = int(rng.integers(1, 4))

        def both(x: Tensor) -> Tensor:
            return torch.cat([x, torch.rot90(x.flip(3), turns, (2, 3))])

        return both(pictures).float() / 255, both(covers), both(weights)


def material(data: Path, work: Path, stage: int) -> Material:
    """What a stage is trained on."""
    held = None if stage == 3 else False
    hands = digit_hands(data, held=held)
    rooms = backgrounds(data, work / "boxes.json", held=held)
    wholes, cut_out = load(work / "labels.npz", data, held=held) if stage > 1 else ([], [])
    log.info("%d hands, %d rooms, %d real pictures", len(hands), len(rooms), len(wholes))
    drawn = drawn_hands(1200, np.random.default_rng(SEED))
    return Material(hands + cut_out, drawn, rooms, wholes)


def train(data: Path, work: Path, stage: int, steps: int, workers: int) -> None:
    """Train one stage; goes on from its checkpoint if there is one."""
    # Before the workers are forked: OpenCV's own threads do not survive a fork.
    cv2.setNumThreads(0)
    torch.manual_seed(SEED)
    network = MaskNet().to(memory_format=torch.channels_last)  # type: ignore[call-overload]
    optimiser = torch.optim.AdamW(network.parameters(), RATE[stage], weight_decay=1e-4)
    schedule = torch.optim.lr_scheduler.OneCycleLR(
        optimiser, RATE[stage], steps, pct_start=0.15 if stage == 1 else 0.05
    )
    checkpoint = work / f"mask-{stage}.ckpt"
    start = 0
    if checkpoint.exists():
        state: dict[str, Any] = torch.load(checkpoint)
        network.load_state_dict(state["network"])
        optimiser.load_state_dict(state["optimiser"])
        schedule.load_state_dict(state["schedule"])
        start = state["step"]
    elif stage > 1:
        network.load_state_dict(torch.load(work / f"mask-{stage - 1}.pt"))
    batches = Batches(material(data, work, stage), stage, steps)
    loader = DataLoader(
        torch.utils.data.Subset(batches, range(start, steps)),
        batch_size=None,
        num_workers=workers,
        prefetch_factor=4 if workers else None,
    )
    network.train()
    mean, began = 0.0, time.monotonic()
    for step, (pictures, covers, weights) in enumerate(loader, start + 1):
        with torch.autocast("cpu", torch.bfloat16):
            logits = network(pictures.to(memory_format=torch.channels_last))
        value = loss(logits.float(), covers, weights)
        optimiser.zero_grad(set_to_none=True)
        value.backward()  # type: ignore[no-untyped-call]
        nn.utils.clip_grad_norm_(network.parameters(), 1.0)
        optimiser.step()
        schedule.step()
        mean += (value.item() - mean) / min(step - start, 50)
        if step % 50 == 0:
            each = (time.monotonic() - began) / (step - start)
            log.info("stage %d step %d loss %.4f, %.2f s each", stage, step, mean, each)
        if step % SAVE_EVERY == 0 or step == steps:
            partial = checkpoint.with_suffix(".part")
            torch.save(
                {
                    "network": network.state_dict(),
                    "optimiser": optimiser.state_dict(),
                    "schedule": schedule.state_dict(),
                    "step": step,
                },
                partial,
            )
            partial.replace(checkpoint)
    torch.save(network.state_dict(), work / f"mask-{stage}.pt")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the photographs")
    parser.add_argument("--work", type=Path, required=True, help="folder for checkpoints")
    parser.add_argument("--stage", type=int, choices=(1, 2, 3), required=True)
    parser.add_argument("--steps", type=int, help="instead of the stage's own number")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--workers", type=int, default=1)
    args = parser.parse_args()
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(message)s")
    torch.set_num_threads(args.threads)
    args.work.mkdir(parents=True, exist_ok=True)
    train(args.data, args.work, args.stage, args.steps or STEPS[args.stage], args.workers)


if __name__ == "__main__":
    main()
