"""The connection with a Dask scheduler, or with one that is started here.

Entry point: `connect`.
"""

from __future__ import annotations

import importlib
import logging
from contextlib import ExitStack
from typing import Any

from coursebuild.api import EffectError, temporary_folder
from coursebuild_cluster import worker

LOCAL = "local"
_PATIENCE = 10.0
"""Seconds in which a scheduler has to answer."""


def connect(address: str, jobs: int) -> tuple[Any, ExitStack]:
    """A client of the scheduler at an address, or of one that is started here, and its end.

    Raises:
        EffectError: there is none, or Dask is not installed.
    """
    try:
        dask, distributed = map(importlib.import_module, ("dask", "distributed"))  # without types
    except ImportError as error:
        help = "run `pip install 'dask[distributed]'`"
        raise EffectError(f"--cluster needs the package {error.name}", help=help) from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is told here
    resources = ExitStack()
    try:
        if address == LOCAL:
            local = distributed.LocalCluster(
                n_workers=jobs,
                threads_per_worker=1,
                memory_limit=0,  # scripts have limits of their own
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
                preload=worker.__name__,  # for its `dask_setup`
                local_directory=resources.enter_context(temporary_folder()),
                # Other users of this machine can reach its ports.
                protocol="tls://",
                security=distributed.Security.temporary(),
            )
            resources.callback(local.close, timeout=_PATIENCE)
            client = distributed.Client(local, set_as_default=False)
        else:
            patience = dask.config.get("distributed.comm.timeouts.connect")
            patience = min(dask.utils.parse_timedelta(patience), _PATIENCE)
            client = distributed.Client(address, timeout=patience, set_as_default=False)
        resources.callback(client.close, timeout=_PATIENCE)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        resources.close()
        cause = str(error.__cause__ or error).strip().splitlines()[:1] or [type(error).__name__]
        help = "`dask scheduler` starts one and says its address, `local` starts one here"
        message = f"--cluster: there is no Dask scheduler at `{address}`: {cause[0]}"
        raise EffectError(message, help=help) from None
    except BaseException:
        resources.close()
        raise
    return client, resources
