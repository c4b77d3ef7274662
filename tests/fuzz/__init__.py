"""Fuzzing: texts and bytes that nobody wrote, tried for as long as one likes.

    make fuzz TIME=1200
    PYTHONPATH=tests python -m fuzz [--seconds N | --runs N] [--seed N] [TARGET …]

1. `targets` says what is tried, each from bytes, and from which inputs it begins.
2. `worker` is a process that tries one target: Atheris (libFuzzer) changes the inputs, and goes on
   with those that reach code that none reached before. What raises, takes too long for its length,
   or takes longer and longer when it is repeated, is written down with its input.
3. `__main__` divides the time among the targets, starts a worker again that was ended by an input
   that hangs or takes all memory, and prints what was tried, survived and found.

`corpus/` holds, in a file for each target, short inputs that reached code which none before them
had reached; `--keep` adds those of a run.
"""
