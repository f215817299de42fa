"""The mask network: a small U-Net whose first convolution halves the picture."""

import itertools
from typing import cast

import torch
import torch.nn.functional as F
from torch import Tensor, nn

CHANNELS = (16, 32, 64, 96)
"""Channels at 1/2, 1/4, 1/8 and 1/16 of the picture."""
SIDE = 160
"""Pixels of the square pictures that it is trained on."""


def _block(inputs: int, outputs: int) -> nn.Sequential:
    layers: list[nn.Module] = []
    for channels in (inputs, outputs):
        layers += [
            nn.Conv2d(channels, outputs, 3, padding=1, bias=False),
            nn.BatchNorm2d(outputs),
            nn.ReLU(inplace=True),
        ]
    return nn.Sequential(*layers)


class MaskNet(nn.Module):
    """(n, 3, h, w) RGB in 0..1 to (n, 1, h/2, w/2) logits of the hand; h, w multiples of 16.

    O. Ronneberger, P. Fischer, T. Brox, "U-Net", MICCAI 2015, with batch normalisation, at half the
    resolution: a template has 60x80 pixels, so a hand needs no more.
    """

    def __init__(self, channels: tuple[int, ...] = CHANNELS) -> None:
        super().__init__()
        first = channels[0]
        self.stem = nn.Sequential(
            nn.Conv2d(3, first, 5, stride=2, padding=2, bias=False),
            nn.BatchNorm2d(first),
            nn.ReLU(inplace=True),
        )
        down = [_block(first, first)]
        down += [_block(a, b) for a, b in itertools.pairwise(channels)]
        self.down = nn.ModuleList(down)
        pairs = list(itertools.pairwise(channels))[::-1]
        self.up = nn.ModuleList([_block(a + b, a) for a, b in pairs])
        self.head = nn.Conv2d(first, 1, 1)

    def forward(self, picture: Tensor) -> Tensor:
        """Logits."""
        x = self.stem(picture - 0.5)
        kept: list[Tensor] = []
        for block in self.down[:-1]:
            x = block(x)
            kept.append(x)
            x = F.max_pool2d(x, 2)
        x = self.down[-1](x)
        for block in self.up:
            x = block(
                torch.cat([F.interpolate(x, scale_factor=2.0, mode="nearest"), kept.pop()], 1)
            )
        return cast(Tensor, self.head(x))


def loss(logits: Tensor, cover: Tensor, weight: Tensor) -> Tensor:
    """Cross-entropy plus Dice (F. Milletari et al., V-Net, 3DV 2016), both weighted by pixel."""
    entropy = F.binary_cross_entropy_with_logits(logits, cover, weight=weight)
    share = torch.sigmoid(logits) * weight
    target = cover * weight
    both = (share * target).sum((1, 2, 3))
    dice = 1 - (2 * both + 20) / (share.sum((1, 2, 3)) + target.sum((1, 2, 3)) + 20)
    return entropy + 0.5 * dice.mean()
