"""Runtime: a LiteRT network on one thread, its input written in place."""

import contextlib
import os
import threading
from pathlib import Path
from typing import Any

import numpy as np

from app.errors import CannotStart
from app.pipeline.types import F32


class Network:
    """One interpreter of one model file. Holds its buffers, so it is one thread's at a time.

    ``invoke`` releases the GIL, so that several sessions' networks run side by side.

    Raises:
        CannotStart: LiteRT is not installed, or the file is not a model.
    """

    def __init__(self, path: Path) -> None:
        try:
            with _quiet():
                from ai_edge_litert.interpreter import Interpreter

                self._interpreter = Interpreter(model_path=str(path), num_threads=1)
                self._interpreter.allocate_tensors()
        except Exception as error:
            raise CannotStart(f"the network {path.name} cannot be read: {error}") from error
        (given,) = self._interpreter.get_input_details()
        outputs = sorted(self._interpreter.get_output_details(), key=lambda d: str(d["name"]))
        self.input_shape: tuple[int, ...] = tuple(int(n) for n in given["shape"])
        self._input: Any = self._interpreter.tensor(given["index"])
        self._outputs: list[Any] = [self._interpreter.tensor(d["index"]) for d in outputs]

    def __call__(self, values: F32) -> list[F32]:
        """Run once.

        Args:
            values: As large as the input, without its leading 1.

        Returns:
            Copies of the outputs, without the leading 1, in the order of their names.
        """
        # LiteRT refuses to run while a view of a tensor is alive, so none is kept.
        np.copyto(self._input()[0], values)
        self._interpreter.invoke()
        return [np.array(output()[0], np.float32) for output in self._outputs]


_descriptor = threading.Lock()
"""Held while descriptor 2 is another one: the later of two at once would put back the wrong one."""


@contextlib.contextmanager
def _quiet() -> Any:
    """LiteRT's native code announces its delegate on standard error; nobody asked for that."""
    with _descriptor:
        saved = os.dup(2)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nowhere, 2)
            yield
        finally:
            os.dup2(saved, 2)
            os.close(saved)
            os.close(nowhere)
