"""Scripts that look at all that a process is started with, and scripts that fail in every way.

`PROBES` and `FAILURES`, by name: what they print must be the same wherever they run.
"""

from __future__ import annotations

PROBES = {
    "not imported": """
        for code in ("json", "numpy", "os.path", "random.random()", "numpy.random"):
            try:
                print(code, type(eval(code)).__name__)
            except Exception as error:
                print(code, repr(error))
    """,
    "identity": """
        import json, numpy, numpy.linalg, sys, importlib.util
        from numpy import linalg
        print(json is sys.modules["json"], linalg is numpy.linalg, numpy.__spec__.name)
        print(numpy.__spec__.loader is numpy.__loader__, json.__spec__.origin == json.__file__)
        print(json.__spec__._initializing if hasattr(json.__spec__, "_initializing") else None)
        print(importlib.import_module("numpy") is numpy, importlib.util.find_spec("numpy").name)
        print(type(importlib.reload(json)) is type(sys), json.loads("[1]"))
        del sys.modules["json"]
        import json as again
        print(again is json)
    """,
    "main": """
        import sys
        print(__name__, __file__, __spec__, __doc__, __package__, __builtins__, __cached__)
        print(type(__loader__).__name__, __loader__.path, __loader__.name, __annotations__)
        print(sys.modules["__main__"].__dict__ is globals(), sorted(globals()))
        print(sys.argv, sys.orig_argv[1:], sys.path, sys.flags, sys.warnoptions)
    """,
    "streams": """
        import os, sys
        for stream in (sys.stdin, sys.stdout, sys.stderr):
            print(stream, stream.line_buffering, stream.write_through, stream.errors,
                  stream.fileno(), stream.isatty(), stream.seekable(), type(stream.buffer).__name__)
        print(sys.stdin.read() == "", sys.stdout is sys.__stdout__, os.get_blocking(1))
        print(os.fstat(0).st_rdev == os.stat("/dev/null").st_rdev)
    """,
    "descriptors and threads": """
        import os, threading
        print(sorted(int(n) for n in os.listdir("/proc/self/fd")))
        print(len(os.listdir("/proc/self/task")), threading.active_count(), threading.enumerate())
        main = threading.main_thread()
        print(main is threading.current_thread(), main.daemon)
    """,
    "signals": """
        import signal
        for number in sorted(signal.valid_signals()):
            print(number, signal.getsignal(number))
        print(signal.pthread_sigmask(signal.SIG_BLOCK, []), signal.set_wakeup_fd(-1))
        print(signal.getitimer(signal.ITIMER_REAL))
    """,
    "process": """
        import os, resource
        print(os.getcwd(), os.getpgrp() == os.getpid(), os.getsid(0) == os.getpid(), os.nice(0))
        print(resource.getrlimit(resource.RLIMIT_NOFILE), oct(os.umask(0)))
        print(sorted((k, v) for k, v in os.environ.items() if k != "TMPDIR"))
        print(os.environ["TMPDIR"] == os.environb[b"TMPDIR"].decode())
        os.system("env | grep -v TMPDIR | grep -v _= | sort")
    """,
    "hooks": """
        import sys, gc, builtins, locale
        print(sys.excepthook is sys.__excepthook__, sys.displayhook is sys.__displayhook__)
        print(sys.gettrace(), sys.getprofile(), sys.getrecursionlimit(), sys.getswitchinterval())
        print(gc.isenabled(), gc.get_threshold(), gc.get_debug(), gc.callbacks)
        print(builtins.__import__, sys.dont_write_bytecode, sys.pycache_prefix)
        print(locale.setlocale(locale.LC_ALL), hash("a"), hash(("b", 1.5)))
        print([type(hook).__name__ for hook in sys.path_hooks], sys.exc_info())
    """,
    "warnings": """
        import warnings
        warnings.warn("first")
        warnings.warn("old", DeprecationWarning)
        import numpy as np
        print(np.array([1.0]) / 0)
        def inner(): warnings.warn("outside", stacklevel=9)
        inner()
    """,
    "source": """
        import inspect, dataclasses, pickle, sys
        @dataclasses.dataclass
        class Point:
            x: int = 1
        print(inspect.getsource(Point), inspect.getfile(Point), inspect.getmodule(Point))
        print(pickle.loads(pickle.dumps(Point(3))), Point.__module__)
    """,
    "exit functions": """
        import atexit, threading, time, weakref, tempfile
        class Loud:
            def __init__(self, name): self.name = name
            def __del__(self): print("deleted", self.name)
        atexit.register(print, "first")
        atexit.register(print, "second")
        weakref.finalize(Loud, print, "finalized")
        def later():
            time.sleep(0.1)
            print("thread")
            atexit.register(print, "from the thread")
        threading.Thread(target=later).start()
        threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
        a, cycle = Loud("a"), Loud("cycle")
        cycle.itself = cycle
        folder = tempfile.TemporaryDirectory()
        print("end", end="")
    """,
    "imports when all is over": """
        import sys
        class Late:
            def __init__(self, *names): self.names = names
            def __del__(self):
                for name in self.names:
                    try:
                        module = __import__(name)
                        print(name, module is sys.modules.get(name), module.__name__)
                    except ImportError as error:
                        print(name, type(error).__name__)
        import numpy, json, os
        late = Late("numpy", "os", "json", "random")
        late.itself = late
        del late
        numpy.late = json.late = os.late = 1
    """,
    "modules are gone when all is over": """
        import json, os
        class Late:
            def __del__(self, json=json): print(json.dumps([1]), os is None, __name__)
        late = Late()
    """,
    "exit function fails": """
        import atexit
        def fails(): raise ValueError("in an exit function")
        atexit.register(fails)
        atexit.register(print, "still")
    """,
    "exits in an exit function": "import atexit, sys\natexit.register(sys.exit, 4)\n",
    "a thread fails": """
        import threading, sys
        def fails(): raise ValueError("in a thread")
        def leaves(): sys.exit(3)
        for target in (fails, leaves):
            thread = threading.Thread(target=target, name="mine")
            thread.start()
            thread.join()
        print("main goes on")
    """,
    "forks": """
        import os, sys
        print("before", flush=True)
        pid = os.fork()
        if pid == 0:
            import numpy, atexit
            atexit.register(print, "child's exit")
            print("child", len(os.listdir("/proc/self/task")))
            sys.exit(7)
        print("parent", os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
    """,
    "a child comes to its end": """
        import os
        pid = os.fork()
        if pid:
            print(os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1]))
        else:
            print("child")
    """,
    "other processes": """
        import multiprocessing, sys
        def square(x): return x * x, __name__, type(multiprocessing.parent_process()).__name__
        if __name__ == "__main__":
            for method in ("fork", "spawn", "forkserver"):
                with multiprocessing.get_context(method).Pool(2) as pool:
                    print(method, pool.map(square, [1, 2, 3]))
            import concurrent.futures
            with concurrent.futures.ThreadPoolExecutor(2) as pool:
                print(list(pool.map(lambda x: x + 1, [1, 2])))
    """,
    "programs": """
        import subprocess, sys
        code = "import sys; print(sorted(sys.modules), sys.path[1:], sys.flags)"
        print(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True))
    """,
    "asyncio": """
        import asyncio
        async def main():
            await asyncio.sleep(0.01)
            return await asyncio.to_thread(sum, [1, 2])
        print(asyncio.run(main()))
    """,
    "numbers": """
        import numpy as np, mujoco, random
        rng = np.random.default_rng(3)
        print(rng.normal(size=3), np.random.RandomState(1).rand(2), np.linalg.eigvalsh(np.eye(3)))
        np.random.seed(2); random.seed(2)
        print(np.random.rand(), random.random(), np.geterr(), np.get_printoptions())
        model = mujoco.MjModel.from_xml_string("<mujoco><worldbody><body><freejoint/>"
            "<geom size='.1'/></body></worldbody></mujoco>")
        data = mujoco.MjData(model)
        mujoco.mj_step(model, data, 100)
        print(data.qpos, model.opt.timestep, isinstance(model, mujoco.MjModel))
    """,
    "deletes its name": "import sys\ndel __file__, __cached__\nsys.exit(5)\n",
    "clears everything": "import sys\nleave = sys.exit\nglobals().clear()\nleave(6)\n",
    "closes its output": "import sys\nprint('x')\nsys.stdout.close()\n",
    "breaks its output": "import os\nprint('x')\nos.close(1)\n",
    "own stream": """
        import sys, io
        sys.stdout = io.TextIOWrapper(io.BytesIO())
        print("never seen")
    """,
    "bytes": "import sys\nsys.stdout.buffer.write(b'raw\\n')\nprint('text')\n",
    "uses C output": """
        import ctypes
        libc = ctypes.CDLL(None)
        libc.printf(b"from C\\n")
        print("from Python")
    """,
}
FAILURES = {
    "exits": [
        f"import sys\nsys.exit({code})\n" for code in ("", "None", "0", "3", "-1", "256", "'why'")
    ]
    + ["raise SystemExit([1, 2])\n", "import sys\nclass E(SystemExit): pass\nraise E(9)\n"],
    "errors": [
        "def f():\n    return 1 / 0\n\n\nf()\n",
        "def f(:\n",
        "  indented\n",
        "x = '\\ud800'\nprint(x)\n",
        "try:\n    1 / 0\nexcept ZeroDivisionError as e:\n    raise ValueError('b') from e\n",
        "import no_such_module\n",
        "import numpy as np\nnp.linalg.inv(np.zeros((2, 2)))\n",
        "import json\njson.loads('{')\n",
        "raise ExceptionGroup('many', [ValueError(1), TypeError(2)])\n",
        "import sys\nsys.excepthook = lambda *a: print('mine', a[0].__name__)\n1 / 0\n",
        "assert False, 'no'\n",
        "import nowhere.at_all as x\n",
        "import traceback\ntry:\n    import numpy.no\nexcept ImportError: traceback.print_exc()\n",
        "import mujoco\nmujoco.MjModel.from_xml_string('<mujoco>')\n",
        "import mujoco, traceback\ntry:\n    mujoco.MjModel.from_xml_path('none.xml')\n"
        "except ValueError: print(traceback.format_exc())\nmujoco.MjSpec.from_file('none.xml')\n",
        "import mujoco\nmujoco.MjModel.from_xml_string(3)\n",
        "import mujoco\nmujoco.MjModel.from_xml_path()\n",
        "import mujoco\ns = mujoco.MjSpec()\ns.add_mesh(name='a', file='none.obj')\ns.compile()\n",
    ],
    "ends": [
        "import os\nprint('lost')\nos._exit(3)\n",
        "import os\nprint('lost')\nos.abort()\n",
        "import ctypes\ndef crash(): ctypes.string_at(0)\ncrash()\n",
        "import faulthandler\nprint(faulthandler.is_enabled())\nfaulthandler.dump_traceback()\n",
        "import os\nos.kill(os.getpid(), 9)\n",
        "import os, sys\nos.execv(sys.executable, [sys.executable, '-c', 'print(1)'])\n",
    ],
    "encodings": [
        "# -*- coding: latin-1 -*-\nprint('\xe9')\n",
        "\ufeffprint('bom')\n",
        "print('a')\r\nprint('b')\r\n",
        "",
        "# only a comment",
        '"""Doc."""\nprint(__doc__)\n',
    ],
}
