"""Processor time before a verb begins: `rig --help`, `import rig`, words for the shell."""

import os
import resource
import subprocess
import sys

_RUNS = 9
_JOBS: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "python -c pass": (("-c", "pass"), {}),
    "import rig": (("-c", "import rig"), {}),
    "rig --help": (("-m", "rig", "--help"), {}),
    "rig c<TAB>": (
        ("-m", "rig"),
        {"_RIG_COMPLETE": "complete_bash", "COMP_WORDS": "rig c", "COMP_CWORD": "1"},
    ),
    "rig sweep s<TAB>": (
        ("-m", "rig"),
        {"_RIG_COMPLETE": "complete_bash", "COMP_WORDS": "rig sweep s", "COMP_CWORD": "2"},
    ),
}


def _processor_s(arguments: tuple[str, ...], environment: dict[str, str]) -> float:
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(
        [sys.executable, *arguments],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    print("| start | processor time, s: least | median |\n|---|---|---|")
    for name, (arguments, environment) in _JOBS.items():
        times_s = sorted(_processor_s(arguments, environment) for _ in range(_RUNS))
        print(f"| `{name}` | {times_s[0]:.3f} | {times_s[_RUNS // 2]:.3f} |")


if __name__ == "__main__":
    main()
