"""MediaPipe Hands in an environment of its own, made on first use; one process, JSON lines."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

VERSION = "0.10.14"
SCRIPT = Path(__file__).resolve().parents[1] / "mediapipe_peer.py"
ONE_THREAD = {
    name: "1"
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "XNNPACK_THREADS")
}


def default_environment() -> Path:
    """Outside the repository, so that its wheel and its linters do not see it."""
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return cache / "farhand" / f"mediapipe-{VERSION}"


def set_up(environment: Path) -> Path:
    """The environment's Python; the environment is made when it is not there."""
    python = environment / "bin" / "python"
    if not python.exists():
        print(f"setting up MediaPipe {VERSION} in {environment}", file=sys.stderr)
        subprocess.run([sys.executable, "-m", "venv", environment], check=True)
        wanted = f"mediapipe=={VERSION}"
        subprocess.run([python, "-m", "pip", "install", "--quiet", wanted], check=True)
    return python


class Peer:
    """The running process. It inherits this one's processor affinity."""

    def __init__(self, environment: Path, confidence: float) -> None:
        self._process = subprocess.Popen(
            # -P: what lies beside the script (operator.py) must not shadow the standard library.
            [set_up(environment), "-P", SCRIPT, str(confidence)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env=os.environ | ONE_THREAD,
        )
        self.version: str = self._receive()["ready"]
        if self.version != VERSION:
            print(f"{environment} holds MediaPipe {self.version}, not {VERSION}", file=sys.stderr)

    def look(self, path: Path, before: Path | None = None) -> dict[str, Any]:
        """Landmarks and times of one file; of a video's frame when ``before`` is given."""
        assert self._process.stdin is not None
        asked = {"path": str(path.resolve()), "before": before and str(before.resolve())}
        print(json.dumps(asked), file=self._process.stdin, flush=True)
        return self._receive()

    def close(self) -> None:
        """End the process."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        self._process.wait(10)

    def _receive(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the MediaPipe process ended with {self._process.wait()}")
        answer: dict[str, Any] = json.loads(line)
        return answer
