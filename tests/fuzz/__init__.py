"""Fuzzing: texts and bytes that nobody wrote, tried for as long as one likes.

    make fuzz TIME=1200
    PYTHONPATH=tests python -m fuzz [--seconds N | --runs N] [--seed N] [TARGET …]

1. `targets` lists what is tried, each a function of bytes with its first inputs: `texts` that
   authors write, what the tool has `kept`, what is `foreign`.
2. `attempts` tries inputs. One that raises, takes too long for its length or more than 10 s of
   processor time or 1 GiB, or takes longer and longer when it is repeated, is written down.
3. `worker` is a process that tries one target: Atheris (libFuzzer) changes the inputs, and goes on
   with those that reach code that none reached before.
4. `__main__` divides the time among the targets, starts a worker again that was ended by an input
   that hangs or takes all memory, and prints what was tried, survived and found.

`corpus/` holds, in a file for each target, short inputs that reached code which none before them
had reached; `--keep` adds those of a run. `NAME-found.json` there has inputs that showed a mistake.
`seeds/` has first inputs as texts, `oss_fuzz/` the same targets as OSS-Fuzz asks for them.
"""
