"""What a hostile script tries in the sandbox, and how that must end.

Entry points: `ATTEMPTS`, expressions of which one script tries all; `EXCESSES`, scripts that take
too much; `surroundings`, what they would find outside; `attempts_script`, `answers`.

Used by the tests and by `benchmarks/attacks.py`.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import platform
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from msgspec import Struct

from coursebuild.core.model.results import Outcome, ScriptRun

SECRET = "hush"
"""What nobody in the sandbox may print."""
KEY_NAME = "coursebuild-probe"
_KEYRING = -3  # the session's; see keyctl(2)
CALLS = {
    name: numbers[platform.machine() != "x86_64"]
    for name, numbers in {
        "add_key": (248, 217),
        "request_key": (249, 218),
        "keyctl": (250, 219),
        "process_vm_readv": (310, 270),
        "pidfd_getfd": (438, 438),
        "bpf": (321, 280),
        "userfaultfd": (323, 282),
        "perf_event_open": (298, 241),
        "io_uring_setup": (425, 425),
        "open_tree": (428, 428),
        "fsopen": (430, 430),
        "mount_setattr": (442, 442),
        "memfd_secret": (447, 447),
        "clone": (56, 220),
        "clone3": (435, 435),
        "kexec_load": (246, 104),
        "finit_module": (313, 273),
    }.items()
}
"""The numbers of system calls on this machine."""
_HELPERS = """
import ctypes, fcntl, glob, mmap, os, platform, resource, signal, socket, struct, sys

libc = ctypes.CDLL(None, use_errno=True)


def call(name, *arguments):
    if name in CALLS:
        arguments, function = (CALLS[name], *arguments), libc.syscall
    else:
        function = libc[name] if isinstance(name, str) else libc.syscall
        arguments = arguments if isinstance(name, str) else (name, *arguments)
    kinds = {int: ctypes.c_long}
    result = function(*(kinds.get(type(a), lambda a: a)(a) for a in arguments))
    if result == -1:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))
    return result


def attempt(what):
    try:
        print(ascii(what()))
    except BaseException as error:
        print(type(error).__name__, error)


def by_old_interrupt():
    # getpid as a 32-bit program calls it: mov eax, 20; int 0x80; ret
    if platform.machine() != "x86_64":
        return -38
    code = mmap.mmap(-1, 4096, flags=mmap.MAP_PRIVATE, prot=7)
    code.write(b"\\xb8\\x14\\0\\0\\0\\xcd\\x80\\xc3")
    return ctypes.CFUNCTYPE(ctypes.c_int)(ctypes.addressof(ctypes.c_char.from_buffer(code)))()


def say(path, kind, text=b"x"):
    with socket.socket(socket.AF_UNIX, kind) as unix:
        unix.connect(path)
        unix.send(text)


def say_by_pair(path, kind):
    for end in socket.socketpair(socket.AF_UNIX, kind):
        end.sendto(b"x", path)


def poke(path, flags):
    os.write(os.open(path, flags | os.O_NONBLOCK), b"x")


def peek(path):
    return os.read(os.open(path, os.O_RDONLY | os.O_NONBLOCK), 9)
"""
"""What a script defines that tries the attempts."""
_NO = "PermissionError [Errno 1]"
_NONE = "OSError [Errno 38]"
_DENIED = ("OSError [Errno", "FileNotFound", "Permission")
_NO_FAMILY = "OSError [Errno 97]"
ATTEMPTS: dict[str, str | tuple[str, ...]] = {
    # the course
    "open('lesson.md', 'a')": "OSError [Errno ",
    "open('new', 'w')": "OSError [Errno ",
    "os.mkdir('folder')": "OSError [Errno ",
    "os.remove('lesson.md')": "OSError [Errno ",
    "os.rename('lesson.md', '/tmp/moved')": "OSError [Errno ",
    "os.chmod('lesson.md', 0o777)": "OSError [Errno ",
    "os.symlink('/etc/passwd', 'examples/y.py')": "OSError [Errno ",
    # sockets and pipes that lie in the course
    "say('stream', socket.SOCK_STREAM)": _NO_FAMILY,
    "say('datagrams', socket.SOCK_DGRAM)": _NO_FAMILY,
    "say('deep/er/stream', socket.SOCK_STREAM)": _NO_FAMILY,
    "say(ABSTRACT, socket.SOCK_STREAM)": _NO_FAMILY,
    "say_by_pair('datagrams', socket.SOCK_DGRAM)": "OSError [Errno 93]",
    "say_by_pair('stream', socket.SOCK_STREAM)": "OSError [Errno 106]",
    "say_by_pair('stream', socket.SOCK_SEQPACKET)": ("OSError", "None"),
    "poke('pipe', os.O_WRONLY)": "PermissionError [Errno 13]",
    "poke('pipe', os.O_RDWR)": "PermissionError [Errno 13]",
    "peek('pipe')": "PermissionError [Errno 13]",
    "poke('deep/er/pipe', os.O_WRONLY)": "PermissionError [Errno 13]",
    "poke('runs/pipe', os.O_WRONLY)": ("PermissionError [Errno 13]", "FileNotFound"),
    "poke('linked-pipe', os.O_WRONLY)": ("PermissionError [Errno 13]", "FileNotFound"),
    # the system
    "open('/proc/sys/kernel/core_pattern', 'w')": _DENIED,
    "open('/proc/sysrq-trigger', 'w')": _DENIED,
    "open('/usr/evil', 'w')": _DENIED,
    "open(sys.executable, 'a')": _DENIED,
    "open('/dev/evil', 'w')": _DENIED,
    "open('/etc/shadow').read()": _DENIED,
    "os.listdir('/run')": _DENIED,
    "os.listdir('/sys/fs/cgroup')": _DENIED,
    "call('mount', b'', os.fsencode(os.getcwd()), b'', 4128, None)": _NO,
    "call('umount2', os.fsencode(os.getcwd()), 2)": _NO,
    "call('open_tree', -100, b'/', 1)": _NO,
    "call('fsopen', b'tmpfs', 0)": _NO,
    "call('mount_setattr', -100, b'/', 0, 0, 0)": _NO,
    "os.chroot('/tmp')": _NO,
    "call('personality', 0x0040000)": _NO,
    "call('kexec_load', 0, 0, 0, 0)": _NO,
    "call('finit_module', 0, b'', 0)": _NO,
    "call('settimeofday', bytes(16), None)": _NO,
    "call('swapon', b'/tmp/x', 0)": _NO,
    "call('klogctl', 3, ctypes.create_string_buffer(99), 99)": _NO,
    "fcntl.ioctl(0, 0x5412, b'x')": _NO,  # TIOCSTI: type for the user
    "fcntl.ioctl(0, 0x541C, b'x')": _NO,  # TIOCLINUX
    # namespaces
    "call('unshare', 0x10000000)": _NO,
    "call('unshare', 0x00020000)": _NO,
    "call('setns', os.open('/proc/self/ns/net', 0), 0)": _NO,
    "call('clone', 0x10000000 | 17, 0, 0, 0, 0)": _NO,
    "call('clone', 0x40000000 | 17, 0, 0, 0, 0)": _NO,
    "call('clone3', 0, 0)": _NONE,
    # the kernel, by what has often let others in
    "call('bpf', 0, 0, 0)": _NO,
    "call('userfaultfd', 0)": _NO,
    "call('perf_event_open', 0, 0, -1, -1, 0)": _NO,
    "call('io_uring_setup', 1, 0)": _NONE,
    "call('open_by_handle_at', -100, None, 0)": _NO,
    "call(0x40000000 | 39)": _NONE,  # getpid of x32
    "by_old_interrupt()": "-38",
    "call(999)": _NONE,
    "socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0)": _NO_FAMILY,
    "socket.socket(socket.AF_PACKET, socket.SOCK_RAW, 0)": _NO_FAMILY,
    "socket.socket(socket.AF_VSOCK, socket.SOCK_STREAM)": _NO_FAMILY,
    "socket.socket(socket.AF_ALG, socket.SOCK_SEQPACKET)": _NO_FAMILY,
    "socket.socket(socket.AF_INET, socket.SOCK_RAW, 1)": _NO,
    "__import__('multiprocessing').Manager()": "EOFError",
    # keys of the user
    "call('keyctl', 10, -3, b'user', b'coursebuild-probe', 0)": _NO,  # search the session's
    "call('keyctl', 11, KEY, ctypes.create_string_buffer(99), 99)": _NO,  # read
    "call('request_key', b'user', b'coursebuild-probe', None, -3)": _NO,
    "call('add_key', b'user', b'evil', b'x', 1, -3)": _NO,
    "open('/proc/keys').read()": _DENIED,
    # the folder of the user, where what is written is gone afterwards
    "open(os.path.expanduser('~/secret')).read()": "FileNotFoundError",
    "os.makedirs(os.path.expanduser('~/.config'))": "None",
    "open(os.path.expanduser('~/.profile'), 'w').write('evil')": "4",
    # other processes
    "os.kill(OTHER, 9)": "ProcessLookupError",
    "call('ptrace', 16, OTHER, 0, 0)": _NO,
    "call('process_vm_readv', OTHER, 0, 0, 0, 0, 0)": _NO,
    "os.sched_setaffinity(OTHER, {0})": "ProcessLookupError",
    "os.kill(TESTS, 9)": "ProcessLookupError",
    "all(int(name) < 9 for name in os.listdir('/proc') if name.isdigit())": "True",
    # the supervisor
    "(os.getppid(), os.kill(1, signal.SIGSTOP), os.kill(1, signal.SIGKILL))": "(1, None, None)",
    "call('ptrace', 16, 1, 0, 0)": _NO,
    "call('ptrace', 0x4206, 1, 0, 0)": _NO,
    "call('pidfd_getfd', os.pidfd_open(1), 0, 0)": _NO,
    "open('/proc/1/mem', 'rb')": "PermissionError [Errno 13]",
    "os.open('/proc/1/mem', os.O_RDWR)": ("PermissionError [Errno 13]", "OSError [Errno 30]"),
    "open('/proc/1/environ').read()": "PermissionError [Errno 13]",
    "[os.open(f'/proc/1/fd/{fd}', os.O_WRONLY) for fd in range(99)]": _DENIED,
    "os.readlink('/proc/1/fd/1')": "PermissionError [Errno 13]",
    "resource.prlimit(1, resource.RLIMIT_CPU, (1, 1))": _NO,
    "os.setpriority(os.PRIO_PROCESS, 1, 19)": _NO,
    "os.setpriority(os.PRIO_USER, 0, 19)": _NO,
    "os.sched_setaffinity(1, {0})": _NO,
    "os.sched_setscheduler(1, os.SCHED_IDLE, os.sched_param(0))": _NO,
    "call('prctl', 1, 0)": _NO,  # not to end with the tool
    # memory that no limit would count
    "os.memfd_create('x')": _NONE,
    "call('memfd_secret', 0)": _NONE,
    "mmap.mmap(-1, 1 << 20)": _NO,
    "resource.getrlimit(resource.RLIMIT_NOFILE)[1] <= 1024": "True",
    "open('/dev/zero', 'r+b')": "PermissionError [Errno 13]",
    "call('shmget', 0, 1 << 20, 0o1600)": _NONE,
    "call('msgget', 0, 0o1600)": _NONE,
}
"""What a script tries, and how the result begins: that of an attempt, or the name of its error."""


class Excess(Struct, frozen=True):
    """A script that takes too much."""

    code: str
    outcome: Outcome
    message: str
    """Part of what it, or the tool about it, says on its standard error."""
    memory: int = 256
    """The MiB that it may take."""
    timeout: float = 60.0


_MEMORY = "as what ran in there took more than 256 MiB of memory"
_PROCESSES = "as what ran in there had more than 256 processes and threads"
_FORKS = (
    "import os, time\nfor _ in range({count}):\n    if not os.fork():\n{code}\ntime.sleep(50)\n"
)
_SLEEP = "        time.sleep(50)"
EXCESSES = {
    "one process": Excess("x = bytearray(1 << 30)", Outcome.FAILED, "MemoryError"),
    "one after the other": Excess(
        "x = []\nfor _ in range(1000): x.append(b'x' * (1 << 20))", Outcome.FAILED, "MemoryError"
    ),
    "eight processes": Excess(
        _FORKS.format(count=8, code=f"        x = b'x' * (80 << 20)\n{_SLEEP}"),
        Outcome.KILLED,
        _MEMORY,
    ),
    "processes that hide": Excess(
        "import ctypes\nctypes.CDLL(None).prctl(4, 0)\n"
        + _FORKS.format(count=8, code=f"        x = b'x' * (80 << 20)\n{_SLEEP}"),
        Outcome.KILLED,
        _MEMORY,
    ),
    "a file in memory, and memory": Excess(
        "import time\nopen('/dev/shm/x', 'wb').write(bytes(150 << 20))\n"
        "x = b'x' * (130 << 20)\ntime.sleep(50)",
        Outcome.KILLED,
        _MEMORY,
    ),
    "files in two places": Excess(
        "import os, time\nfor folder in '/tmp', '/dev/shm':\n"
        "    os.makedirs(folder, exist_ok=True)\n"
        "    open(folder + '/x', 'wb').write(bytes(150 << 20))\ntime.sleep(50)",
        Outcome.KILLED,
        _MEMORY,
    ),
    "a file too large": Excess(
        "with open('/dev/shm/x', 'wb') as file:\n"
        "    for _ in range(1500): file.write(bytes(1 << 20))",
        Outcome.FAILED,
        "No space left on device",
        memory=2048,
    ),
    "a file that is mapped": Excess(
        "import mmap, os, time\n"
        "fd = os.open('/dev/shm', os.O_TMPFILE | os.O_RDWR)\n"
        "os.ftruncate(fd, 150 << 20)\n"
        "mmap.mmap(fd, 150 << 20).write(bytes(150 << 20))\n"
        "x = b'x' * (150 << 20)\ntime.sleep(50)",
        Outcome.KILLED,
        _MEMORY,
    ),
    "empty files": Excess(
        "import os, time\nfor i in range(1 << 20): os.mknod(f'/dev/shm/{i}')\ntime.sleep(50)",
        Outcome.KILLED,
        "more than 64 MiB",
        memory=64,
    ),
    "what sockets keep": Excess(
        "import os, socket, time\nends = []\n"
        "for _ in range(3):\n"
        "    if os.fork(): continue\n"
        "    for _ in range(400):\n"
        "        ends += socket.socketpair()\n"
        "        ends[-1].setblocking(False)\n"
        "        try:\n"
        "            while True: ends[-1].send(bytes(9999))\n"
        "        except BlockingIOError: pass\n"
        "time.sleep(50)",
        Outcome.KILLED,
        _MEMORY,
    ),
    "1200 processes": Excess(
        _FORKS.format(count=1200, code=_SLEEP), Outcome.KILLED, _PROCESSES, memory=16384
    ),
    "processes that fork": Excess(
        "import os\nwhile True: os.fork()", Outcome.KILLED, _PROCESSES, memory=16384
    ),
    "processes that fork and end": Excess(
        "import os\nfor _ in range(40):\n    if not os.fork(): break\n"
        "while True:\n    if os.fork(): os._exit(0)\n",
        Outcome.OK,
        "",
        memory=16384,
    ),
    "threads": Excess(
        "import threading, time\nthreading.stack_size(1 << 16)\n"
        "for _ in range(400): threading.Thread(target=time.sleep, args=[50]).start()",
        Outcome.KILLED,
        _PROCESSES,
        memory=16384,
    ),
    "time": Excess("while True: pass", Outcome.TIMEOUT, "line 1 in <module>", timeout=1.0),
    "time, after the supervisor was stopped": Excess(
        "import os, time\nos.kill(os.getppid(), 19)\ntime.sleep(50)",
        Outcome.TIMEOUT,
        "line 3 in <module>",
        timeout=1.0,
    ),
}
"""Scripts that take too much, and how they end."""


@contextlib.contextmanager
def surroundings(root: Path, home: Path) -> Iterator[Mapping[str, object]]:
    """What scripts would find outside; the values of the names in `ATTEMPTS`.

    Nobody talked to the sockets and pipes in the end.
    """
    (home / "secret").write_text(SECRET)
    (root / "lesson.md").write_text("as it was")
    abstract = f"\0coursebuild-{os.getpid()}"
    with contextlib.ExitStack() as stack:
        streams = [_listen(stack, root / path) for path in ("stream", "deep/er/stream")]
        streams.append(_listen(stack, abstract))
        datagrams = stack.enter_context(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM))
        _bind(datagrams, root / "datagrams")
        pipes = []
        for path in ("pipe", "deep/er/pipe", "runs/pipe"):
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            os.mkfifo(root / path)
            pipes.append(os.open(root / path, os.O_RDWR | os.O_NONBLOCK))
            stack.callback(os.close, pipes[-1])
        (root / "linked-pipe").symlink_to(root / "pipe")
        program = [sys.executable, "-c", "print(flush=True); import time; time.sleep(600)"]
        environment = {**os.environ, "SECRET": SECRET}
        neighbour = stack.enter_context(
            subprocess.Popen(program, env=environment, stdout=subprocess.PIPE)
        )
        stack.callback(neighbour.kill)
        assert neighbour.stdout is not None and neighbour.stdout.readline()
        yield {
            "CALLS": CALLS,
            "KEY": _add_key(stack),
            "OTHER": neighbour.pid,
            "TESTS": os.getpid(),
            "ABSTRACT": abstract,
        }
        for listener in (*streams, datagrams):
            listener.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                raise AssertionError(
                    listener.recv(9) if listener is datagrams else listener.accept()
                )
        for pipe in pipes:
            with contextlib.suppress(BlockingIOError):
                raise AssertionError(os.read(pipe, 9))
        assert neighbour.poll() is None
        assert (root / "lesson.md").read_text() == "as it was"
        assert [path.name for path in home.iterdir()] == ["secret"]


def _listen(stack: contextlib.ExitStack, place: Path | str) -> socket.socket:
    listener = stack.enter_context(socket.socket(socket.AF_UNIX))
    _bind(listener, place)
    listener.listen()
    return listener


def _bind(listener: socket.socket, place: Path | str) -> None:
    """Bind a socket; the path of one in a folder may be too long unless relative."""
    if isinstance(place, str):
        listener.bind(place)
        return
    place.parent.mkdir(parents=True, exist_ok=True)
    with contextlib.chdir(place.parent):
        listener.bind(place.name)


def _add_key(stack: contextlib.ExitStack) -> int:
    """Put the secret into this session's keyring; 0 where the machine has no keys."""
    libc = ctypes.CDLL(None)
    data = SECRET.encode()
    key: int = libc.syscall(CALLS["add_key"], b"user", KEY_NAME.encode(), data, len(data), _KEYRING)
    stack.callback(libc.syscall, CALLS["keyctl"], 9, key, _KEYRING)  # unlink
    return max(key, 0)


def attempts_script(names: Mapping[str, object]) -> str:
    """A script that makes all attempts, and prints a line for each."""
    definitions = "".join(f"{name} = {value!r}\n" for name, value in names.items())
    return _HELPERS + definitions + "".join(f"attempt(lambda: {attempt})\n" for attempt in ATTEMPTS)


def answers(run: ScriptRun) -> dict[str, str]:
    """What became of each attempt that did not end as it must."""
    lines = run.stdout.splitlines()
    if len(lines) != len(ATTEMPTS):
        return {"all": f"{run.outcome.value}, {len(lines)} lines: {run.stderr}"}
    expected = zip(ATTEMPTS.items(), lines, strict=True)
    return {attempt: line for (attempt, end), line in expected if not line.startswith(end)}
