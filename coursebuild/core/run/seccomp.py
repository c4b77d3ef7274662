"""The filter of system calls for scripts in a sandbox, as a program that `bwrap --seccomp` loads.

What is refused serves to look at other processes, to change the machine, or to take memory that no
limit counts. All that Python, NumPy and MuJoCo call stays allowed, as do `fork`, threads, pipes,
and sockets of the sandbox's own network. The program is classic BPF, see seccomp(2): it has no
loops, and looks at numbers only, so it cannot see the address of a socket.
"""

from __future__ import annotations

import errno
import struct

from msgspec import Struct

_ARCHITECTURES = {"x86_64": (0xC000003E, 0), "aarch64": (0xC00000B7, 1)}
"""For each machine its `AUDIT_ARCH_*`, see linux/audit.h, and its column in the tables below."""
_LAST = 462
"""The last call that was looked through when this was written: a newer one is unknown, as on an
older Linux. The calls of x32, another way to make all of them, have higher numbers too."""

_REFUSED: dict[str, tuple[int | None, int | None]] = {
    # keys of the user
    "add_key": (248, 217),
    "request_key": (249, 218),
    "keyctl": (250, 219),
    # other processes
    "ptrace": (101, 117),
    "process_vm_readv": (310, 270),
    "process_vm_writev": (311, 271),
    "process_madvise": (440, 440),
    "process_mrelease": (448, 448),
    "pidfd_getfd": (438, 438),
    "kcmp": (312, 272),
    "migrate_pages": (256, 238),
    "move_pages": (279, 239),
    # programs in the kernel, and what has often let others in there
    "bpf": (321, 280),
    "userfaultfd": (323, 282),
    "perf_event_open": (298, 241),
    "vmsplice": (278, 75),
    "remap_file_pages": (216, 234),
    "modify_ldt": (154, None),
    "uselib": (134, None),
    "_sysctl": (156, None),
    "sysfs": (139, None),
    "personality": (135, 92),
    "lookup_dcookie": (212, 18),
    "nfsservctl": (180, 42),
    # mounts and namespaces
    "mount": (165, 40),
    "umount2": (166, 39),
    "pivot_root": (155, 41),
    "chroot": (161, 51),
    "move_mount": (429, 429),
    "open_tree": (428, 428),
    "fsopen": (430, 430),
    "fsconfig": (431, 431),
    "fsmount": (432, 432),
    "fspick": (433, 433),
    "mount_setattr": (442, 442),
    "unshare": (272, 97),
    "setns": (308, 268),
    # files by handles, past what is shown
    "name_to_handle_at": (303, 264),
    "open_by_handle_at": (304, 265),
    "fanotify_init": (300, 262),
    "fanotify_mark": (301, 263),
    # the machine
    "kexec_load": (246, 104),
    "kexec_file_load": (320, 294),
    "init_module": (175, 105),
    "finit_module": (313, 273),
    "delete_module": (176, 106),
    "create_module": (174, None),
    "get_kernel_syms": (177, None),
    "query_module": (178, None),
    "iopl": (172, None),
    "ioperm": (173, None),
    "quotactl": (179, 60),
    "quotactl_fd": (443, 443),
    "swapon": (167, 224),
    "swapoff": (168, 225),
    "reboot": (169, 142),
    "settimeofday": (164, 170),
    "clock_settime": (227, 112),
    "clock_adjtime": (305, 266),
    "adjtimex": (159, 171),
    "acct": (163, 89),
    "syslog": (103, 116),
    "vhangup": (153, 58),
    "sethostname": (170, 161),
    "setdomainname": (171, 162),
}
"""The calls that are not permitted, each with its numbers on x86_64 and aarch64."""
_ABSENT: dict[str, tuple[int | None, int | None]] = {
    # memory that belongs to no process and lies in no folder, so that nobody could count it
    "memfd_create": (319, 279),
    "memfd_secret": (447, 447),
    "shmget": (29, 194),
    "semget": (64, 190),
    "msgget": (68, 186),
    "io_uring_setup": (425, 425),
    "io_uring_enter": (426, 426),
    "io_uring_register": (427, 427),
    # its flags lie in memory, which a filter cannot read; the C library then calls `clone`
    "clone3": (435, 435),
}
"""The calls that are as in a Linux without them, for which programs have other ways."""


class _Condition(Struct, frozen=True):
    """A call that is refused if an argument, masked, is one of some values, or is none of them."""

    numbers: tuple[int, int]
    argument: int
    values: tuple[int, ...]
    is_refused: bool
    """Whether these values are refused, or all others."""
    mask: int = 0xFFFFFFFF
    error: int = errno.EPERM


_SUPERVISOR = 1
"""The number of the supervisor's process in its sandbox."""
_CONDITIONS = (
    # CLONE_NEWNS, NEWCGROUP, NEWUTS, NEWIPC, NEWUSER, NEWPID, NEWNET
    _Condition((56, 220), 0, (0,), False, mask=0x7E020000),
    # `socket` for IPv4 and IPv6: a socket of another family could reach one that lies in a folder.
    _Condition((41, 198), 0, (2, 10), False, error=errno.EAFNOSUPPORT),
    # `socketpair` of AF_UNIX, SOCK_STREAM or SOCK_SEQPACKET: a datagram can be sent anywhere.
    _Condition((53, 199), 0, (1,), False, error=errno.EAFNOSUPPORT),
    _Condition((53, 199), 1, (1, 5), False, mask=0xF, error=errno.EPROTONOSUPPORT),
    # `ioctl` with TIOCSTI and TIOCLINUX, which type for the user
    _Condition((16, 29), 1, (0x5412, 0x541C), True),
    # `mmap` with MAP_SHARED and MAP_ANONYMOUS: such memory is there when nobody has mapped it.
    _Condition((9, 222), 3, (0x21,), True, mask=0x21),
    # `prctl` with PR_SET_PDEATHSIG, by which the sandbox ends with the tool
    _Condition((157, 167), 0, (1,), True),
    # `prlimit64`, `sched_setaffinity`, `…param`, `…scheduler`, `…attr`, `ioprio_set`, `setpriority`
    _Condition((302, 261), 0, (_SUPERVISOR,), True),
    _Condition((203, 122), 0, (_SUPERVISOR,), True),
    _Condition((142, 118), 0, (_SUPERVISOR,), True),
    _Condition((144, 119), 0, (_SUPERVISOR,), True),
    _Condition((314, 274), 0, (_SUPERVISOR,), True),
    _Condition((251, 30), 0, (1,), False),
    _Condition((251, 30), 1, (_SUPERVISOR,), True),
    _Condition((141, 140), 0, (0,), False),
    _Condition((141, 140), 1, (_SUPERVISOR,), True),
)

_LOAD, _MASK, _RETURN = 0x20, 0x54, 0x06
_EQUAL, _AT_LEAST = 0x15, 0x35
_NUMBER, _ARCHITECTURE, _ARGUMENTS = 0, 4, 16
"""Where these lie in `struct seccomp_data`; of an argument, of eight bytes, the lower half counts
for all calls above, and comes first, as both machines are little-endian."""
_ALLOW, _FAIL = 0x7FFF0000, 0x00050000


def compile_filter(machine: str) -> bytes | None:
    """The filter for a machine, named as by `platform.machine`; `None` for an unknown one."""
    if machine not in _ARCHITECTURES:
        return None
    architecture, column = _ARCHITECTURES[machine]
    program = [
        _instruction(_LOAD, _ARCHITECTURE),
        _instruction(_EQUAL, architecture, 1, 0),
        _instruction(_RETURN, _FAIL | errno.ENOSYS),
        _instruction(_LOAD, _NUMBER),
        _instruction(_AT_LEAST, _LAST + 1, 0, 1),
        _instruction(_RETURN, _FAIL | errno.ENOSYS),
    ]
    for table, error in ((_REFUSED, errno.EPERM), (_ABSENT, errno.ENOSYS)):
        for numbers in table.values():
            if (number := numbers[column]) is not None:
                program.append(_instruction(_EQUAL, number, 0, 1))
                program.append(_instruction(_RETURN, _FAIL | error))
    for condition in _CONDITIONS:
        # Refuse the call if the condition holds; else load its number again.
        body = [
            _instruction(_LOAD, _ARGUMENTS + 8 * condition.argument),
            _instruction(_MASK, condition.mask),
        ]
        for left, value in reversed(list(enumerate(reversed(condition.values)))):
            if_equal, if_not = (left, int(left == 0)) if condition.is_refused else (left + 1, 0)
            body.append(_instruction(_EQUAL, value, if_equal, if_not))
        body.append(_instruction(_RETURN, _FAIL | condition.error))
        body.append(_instruction(_LOAD, _NUMBER))
        program.append(_instruction(_EQUAL, condition.numbers[column], 0, len(body)))
        program += body
    program.append(_instruction(_RETURN, _ALLOW))
    return b"".join(program)


def _instruction(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    """A `struct sock_filter`; the jumps count the instructions that are left out."""
    return struct.pack("=HBBI", code, if_true, if_false, value)
