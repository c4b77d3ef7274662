"""The program of a process that runs scripts: a supervisor or, started for it alone, one script.

A supervisor's copies come back from `main` to become scripts, so that the frame of this module is
the only one below a script's own.
"""

import sys

if __name__ == "__main__":
    INITIAL_MODULES = frozenset(sys.modules)
    ROOT = __file__.rsplit("/", 4)[0]
    sys.path[0] = ROOT  # not this file's folder, whose modules have the names of others
    from coursebuild.core.run import script_process, supervisor

    sys.path.remove(ROOT)
    script = supervisor.main(sys.argv[1:], INITIAL_MODULES)
    try:
        exec(script.compile_script(), script.names)
    except SystemExit:
        raise
    except BaseException as error:
        script_process.report_error(error)
        sys.exit(1)
