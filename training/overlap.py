"""How well a mask network covers the hands of rooms kept aside.

``python -m training.overlap --data PHOTOS --work DIR --model FILE`` prints the overlap
(intersection over union) of its masks with the labels of :mod:`training.labels`, where they have a
weight. The network must be one that did not see these rooms: stage 1 or 2.
"""

import argparse
from pathlib import Path

import cv2
import numpy as np

from app.pipeline import mask
from training.labels import load


def overlaps(data: Path, work: Path) -> list[float]:
    """Of every labelled box of the rooms kept aside."""
    found = []
    for whole in load(work / "labels.npz", data, held=True)[0]:
        seen = mask.LearnedMask()(whole.colour)
        x, y, width, height = seen.bounds
        part = slice(y, y + height), slice(x, x + width)
        weight = whole.weight[part] > 0.5
        hand, label = seen.mask[part] == 1, whole.cover[part] > 0.5
        both, either = (hand & label & weight).sum(), ((hand | label) & weight).sum()
        found.append(float(both / max(either, 1)))
    return found


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, required=True, help="folder of the photographs")
    parser.add_argument("--work", type=Path, required=True, help="folder of labels.npz")
    parser.add_argument("--model", type=Path, required=True, help="ONNX file of the network")
    args = parser.parse_args()
    cv2.setNumThreads(1)
    # An absolute path is taken as it is when joined to the folder of the networks.
    mask.MODEL = str(args.model.resolve())
    found = overlaps(args.data, args.work)
    tenth, median = np.percentile(found, (10, 50))
    print(f"{len(found)} pictures: median {median:.3f}, tenth percentile {tenth:.3f}")


if __name__ == "__main__":
    main()
