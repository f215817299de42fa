"""Networks: ONNX files beside the code, one session a process, one thread a call."""

import functools
from importlib.resources import files

import onnxruntime

from app.errors import CannotStart


@functools.cache
def load(name: str) -> onnxruntime.InferenceSession:
    """The network of a file in ``app/pipeline/models``; safe to run from any thread.

    Raises:
        CannotStart: the file is missing or broken.
    """
    options = onnxruntime.SessionOptions()
    # Frames of several operators are worked on side by side: one thread each.
    options.intra_op_num_threads = 1
    options.inter_op_num_threads = 1
    options.log_severity_level = 3
    try:
        model = files("app.pipeline.models").joinpath(name).read_bytes()
        return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise CannotStart(f"the network {name} cannot be read: {error}") from error
