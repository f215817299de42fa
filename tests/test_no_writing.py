"""Nothing that moves, stops, answers or serves writes to a file, pipe, terminal or disk by itself.

A thread that writes may wait without end for whoever reads, or for a disk. Lines go to the log
(:mod:`app.logs`), all else to a thread whose work it is; what may write is named here, and why it
holds nobody up.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
WATCHED = ("app/gateway", "app/link", "app/pipeline", "app/robot")
"""What the control loop, the event loop and the threads of frames, stops and pictures run."""

BEFORE = "before the loop begins"
THREAD = "in a thread of its own"
MAY_WRITE = {
    "app/gateway/greeting.py": "in a thread of its own, to a stream that waits for nobody",
    "app/gateway/gallery.py::open_store": f"{THREAD}, before anything is served",
    "app/gateway/robot_port.py": "a folder for the link: before the node starts, and after its end",
    "app/gateway/serve.py::lock_data_folder": "before anything is served",
    "app/gateway/tls.py": f"{THREAD}, or before anything is served",
    "app/gateway/tokens.py::TokenStore._change": "by the command line, and by the greeting",
    "app/gateway/viser_server.py::PrivateServer": "a folder for the socket: the 3D view's thread",
    "app/link/node_end.py::NodeEnd.__init__": BEFORE,
    "app/link/node_end.py::private_folder": BEFORE,
    "app/pipeline/hand_landmarks/files.py::take_from": "by the command line",
    "app/pipeline/hand_landmarks/runtime.py::_quiet": "to /dev/null, which never waits",
    "app/robot/beside.py::give_way": "the processes beside the node, when they start",
    "app/robot/latch.py::StopLatch._begin": "the latch's thread, when it begins",
    "app/robot/latch_file.py": "the latch's thread alone, which nobody waits for",
    "app/robot/models/": f"{BEFORE}, or in a process beside it",
    "app/robot/latch_lock.py::_take": "a thread of its own, and a lock between processes",
    "app/robot/node.py::main": BEFORE,
    "app/robot/sim/__init__.py": BEFORE,
    "app/robot/sim/scenery.py::_load_visuals": "the camera process, when it starts",
}
"""Files, folders and functions, with the reason."""

CALLS = {
    "basicConfig", "breakpoint", "copyfile", "copytree", "dictConfig", "fdatasync", "FileHandler",
    "fileConfig", "flock", "fsync", "hardlink_to", "imwrite", "input", "makedirs", "mkdir",
    "mkdtemp", "mkstemp", "NamedTemporaryFile", "print", "print_exc", "print_exception",
    "print_stack", "rename", "renames", "rmdir", "RotatingFileHandler", "rmtree", "savefig",
    "StreamHandler", "symlink_to", "SysLogHandler", "TemporaryDirectory", "TemporaryFile", "touch",
    "truncate", "unlink", "write_bytes", "write_text", "writelines",
}  # fmt: skip
OURS = {"private_file", "private_folder", "ProcessLock", "ScratchFolder"}
"""What of ours writes at once, in a module that is not watched."""
OF_OS = {"fdopen", "link", "mkfifo", "open", "remove", "replace", "sendfile", "symlink", "write"}
STREAMS = {"stdout", "stderr", "__stdout__", "__stderr__"}


class Writes(ast.NodeVisitor):
    """Finds what may write, with the function that it stands in."""

    def __init__(self) -> None:
        self.found: list[tuple[str, int, str]] = []
        self._inside: list[str] = []

    def _enter(self, node: ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef) -> None:
        self._inside.append(node.name)
        self.generic_visit(node)
        self._inside.pop()

    visit_FunctionDef = visit_AsyncFunctionDef = visit_ClassDef = _enter

    def _note(self, node: ast.expr, what: str) -> None:
        self.found.append((".".join(self._inside), node.lineno, what))

    def visit_Attribute(self, node: ast.Attribute) -> None:
        if isinstance(node.value, ast.Name) and node.value.id == "sys" and node.attr in STREAMS:
            self._note(node, f"sys.{node.attr}")
        self.generic_visit(node)

    def visit_Call(self, node: ast.Call) -> None:
        function = node.func
        if isinstance(function, ast.Name):
            if function.id in CALLS | OURS or (function.id == "open" and _writes(node, 1)):
                self._note(node, function.id)
        elif isinstance(function, ast.Attribute):
            name, of = function.attr, function.value
            if (
                name in CALLS
                or (isinstance(of, ast.Name) and of.id == "os" and name in OF_OS)
                # Path.replace has one argument; str.replace and dataclasses.replace have not.
                or (name == "replace" and len(node.args) == 1 and not node.keywords)
                or (name == "open" and node.args and _writes(node, 0))
            ):
                self._note(node, name)
        self.generic_visit(node)


def _writes(node: ast.Call, position: int) -> bool:
    """Whether a call of ``open`` may open for writing."""
    modes = [*node.args[position : position + 1]]
    modes += [each.value for each in node.keywords if each.arg == "mode"]
    if not all(isinstance(mode, ast.Constant) and isinstance(mode.value, str) for mode in modes):
        return position == 1  # of a method of ours that is called so, the argument is no mode
    return any(set(mode.value) & set("wax+") for mode in modes)  # type: ignore[attr-defined]


def writes(source: str) -> list[tuple[str, int, str]]:
    finder = Writes()
    finder.visit(ast.parse(source))
    return finder.found


def everywhere() -> Iterator[tuple[str, str, str]]:
    """File, function and text of each place that may write."""
    for folder in WATCHED:
        for path in sorted((ROOT / folder).rglob("*.py")):
            name = path.relative_to(ROOT).as_posix()
            for inside, line, what in writes(path.read_text()):
                yield name, inside, f"{name}:{line}: {what} in {inside or 'the module'}"


def permission(name: str, inside: str) -> str | None:
    for key in MAY_WRITE:
        file, _, function = key.partition("::")
        here = name.startswith(file) if file.endswith("/") else name == file
        if here and (not function or f"{inside}.".startswith(f"{function}.")):
            return key
    return None


def test_nothing_writes_but_what_is_named() -> None:
    assert [text for name, inside, text in everywhere() if permission(name, inside) is None] == []


def test_nothing_is_named_that_does_not_write() -> None:
    used = {permission(name, inside) for name, inside, _ in everywhere()}
    assert set(MAY_WRITE) - used == set()


@pytest.mark.parametrize(
    "line",
    [
        "print('x')",
        "open('f', 'w')",
        "open('f', mode)",
        "open('f', mode='r+')",
        "path.open('ab')",
        "path.write_bytes(b'')",
        "part.replace(path)",
        "os.replace(part, path)",
        "os.fsync(handle)",
        "os.write(2, b'')",
        "sys.stderr.write('x')",
        "sys.stdout.flush()",
        "logging.basicConfig()",
        "logging.StreamHandler()",
        "traceback.print_exc()",
        "cv2.imwrite('f', picture)",
        "tempfile.mkdtemp()",
    ],
)
def test_writing_is_found(line: str) -> None:
    assert [inside for inside, _, _ in writes(f"class A:\n  def b(self):\n    {line}")] == ["A.b"]


@pytest.mark.parametrize(
    "line",
    ["open('f')", "open('f', 'rb')", "path.read_bytes()", "'a'.replace('a', 'b')",
     "await hub.open(settings)", "log.info('x')", "replace(state, tick=1)"],
)  # fmt: skip
def test_what_does_not_write_is_left_alone(line: str) -> None:
    assert writes(f"async def a():\n    {line}") == []
