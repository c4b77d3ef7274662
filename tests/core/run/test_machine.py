"""The machine as reports name it."""

from __future__ import annotations

import pytest

from coursebuild.core.run.script_environment import cpu_name, find_cpu_name, machine

X86 = """\
processor\t: 0
vendor_id\t: GenuineIntel
model\t\t: 85
model name\t: A   Processor\t@ 2.00GHz

processor\t: 1
model name\t: Another
"""
ARM = "processor\t: 0\nBogoMIPS\t: 50.00\nCPU implementer\t: 0x41\n\nModel\t\t: A Board Rev 1.1\n"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (X86, "A Processor @ 2.00GHz"),
        (ARM, "A Board Rev 1.1"),
        ("model name\t:\nHardware\t: A Chip\n", "A Chip"),
        ("", ""),
        ("no colon", ""),
        (f"model name: {'x' * 500}", "x" * 100),
    ],
)
def test_names_of_processors(text: str, name: str) -> None:
    assert find_cpu_name(text) == name


def test_this_machine() -> None:
    this_machine = machine()
    assert this_machine.engine.count(".") == 2
    assert this_machine.system
    assert this_machine.cpu == cpu_name()
    assert "\n" not in this_machine.cpu
