"""The program that becomes Bubblewrap, with a session keyring of its own and few open files.

Its arguments: the filter of system calls as hexadecimal digits, and the command.
"""

import ctypes
import errno
import os
import platform
import resource
import sys

JOIN_SESSION_KEYRING = 1  # linux/keyctl.h
KEYCTL = {"x86_64": 250, "aarch64": 219}

if __name__ == "__main__":
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(KEYCTL[platform.machine()], JOIN_SESSION_KEYRING, None) < 0:
        error = ctypes.get_errno()
        if error not in (errno.ENOSYS, errno.EPERM):  # there it reaches no keyring whatever
            sys.exit(f"a session keyring cannot be created: {os.strerror(error)}")
    for limit, most in ((resource.RLIMIT_NOFILE, 1024), (resource.RLIMIT_MSGQUEUE, 0)):
        _, hard = resource.getrlimit(limit)
        most = most if hard == resource.RLIM_INFINITY else min(most, hard)
        resource.setrlimit(limit, (most, most))
    reader, writer = os.pipe()
    os.write(writer, bytes.fromhex(sys.argv[1]))
    os.close(writer)
    os.set_inheritable(reader, True)
    program, *arguments = sys.argv[2:]
    os.execv(program, [program, "--seccomp", str(reader), *arguments])
