"""Write a trained network as the ONNX file that the product ships.

``python -m training.export --work DIR --stage 3 --out app/pipeline/models/hand_mask.onnx``. Weights
are stored in half precision and widened when the file is loaded: half the size, and on the
kept-aside photographs not one mask differs by more than a few pixels.
"""

import argparse
import hashlib
from pathlib import Path
from typing import Any, cast

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from training.network import SIDE, MaskNet

LARGEST = 1_000_000
"""Bytes that the file may have."""


class Shipped(nn.Module):
    """(h, w, 3) uint8 BGR to (h/2, w/2) float32 share of hand; h and w multiples of 16."""

    def __init__(self, network: MaskNet) -> None:
        super().__init__()
        self.network = network

    def forward(self, picture: Tensor) -> Tensor:
        """The whole way, so that whoever runs the file has nothing to prepare."""
        planes = picture.flip(2).permute(2, 0, 1).unsqueeze(0).float() / 255
        return cast(Tensor, torch.sigmoid(self.network(planes))[0, 0])


def halve_weights(model: Any) -> None:
    """Store every large weight as float16, cast to float32 by the graph; in place."""
    graph = model.graph
    casts = []
    for weight in list(graph.initializer):
        if weight.data_type != TensorProto.FLOAT or np.prod(weight.dims) < 64:
            continue
        name = weight.name
        half = numpy_helper.from_array(
            numpy_helper.to_array(weight).astype(np.float16), f"{name}_half"
        )
        graph.initializer.remove(weight)
        graph.initializer.append(half)
        casts.append(helper.make_node("Cast", [half.name], [name], to=TensorProto.FLOAT))
    for node in reversed(casts):
        graph.node.insert(0, node)


def export(network: nn.Module, example: Tensor, out: Path, dynamic: dict[str, Any]) -> None:
    """Write ``network`` for pictures like ``example``; checks the file and its size."""
    torch.onnx.export(
        network.eval(),
        (example,),
        str(out),
        dynamo=False,
        opset_version=17,
        input_names=["input"],
        output_names=["output"],
        dynamic_axes=dynamic,
    )
    model = onnx.load(str(out))
    halve_weights(model)
    model.doc_string = ""
    onnx.checker.check_model(model, full_check=True)
    onnx.save(model, str(out))
    size = out.stat().st_size
    if size > LARGEST:
        raise SystemExit(f"{out} has {size} bytes: at most {LARGEST} are wanted")
    print(f"{out}: {size} bytes, sha256 {hashlib.sha256(out.read_bytes()).hexdigest()}")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, required=True, help="folder of the checkpoints")
    parser.add_argument("--stage", type=int, choices=(1, 2, 3), default=3)
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    network = MaskNet()
    network.load_state_dict(torch.load(args.work / f"mask-{args.stage}.pt"))
    example = torch.zeros((SIDE, SIDE, 3), dtype=torch.uint8)
    dynamic = {"input": {0: "h", 1: "w"}, "output": {0: "h2", 1: "w2"}}
    export(Shipped(network), example, args.out, dynamic)


if __name__ == "__main__":
    main()
