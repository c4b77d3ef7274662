"""`--cluster ADDRESS`: a course's scripts and measurements on the workers of a Dask scheduler.

- `connection`: a scheduler, reached or started here
- `executor`: what a command asks, here: which worker does what
- `results`: what becomes of the answers of scripts, here
- `worker`: what Dask calls on a worker; the work itself is done by a process beside it
- `child`: that process, with its copy of the course
- `course_copy`: a course as a list of hashes, and a folder that is brought to the same state
- `messages`: what travels, all of it as bytes of msgspec
"""

from __future__ import annotations

from coursebuild.api import ExecutorKind, Feature

CLUSTER = ExecutorKind(
    option="--cluster",
    metavar="ADDRESS",
    help="work on the machines of this Dask scheduler, such as tls://host:8786, which is trusted "
    "like this machine: whoever can reach it can run any code there and here; `local` starts one "
    "with a worker for each processor",
    module="coursebuild_cluster.executor",
)
FEATURE = Feature(name="cluster", executors=(CLUSTER,))
