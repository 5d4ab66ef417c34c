"""Compilation of exported C for this platform."""

import os
import platform
import shlex
import shutil
import subprocess
from pathlib import Path

from gpi_hammerstein._native import ParameterError

#: Names of systems in a platform tuple of FMI 3.0, and the ending of a shared library.
SYSTEMS = {"Linux": ("linux", ".so"), "Darwin": ("darwin", ".dylib"), "Windows": ("windows", ".dll")}
MACHINES = {"x86_64": "x86_64", "amd64": "x86_64", "aarch64": "aarch64", "arm64": "aarch64"}
#: A compilation takes less than a second.
LONGEST = 120.0


def platform_tuple() -> tuple[str, str]:
    """Return the name of this platform in FMI 3.0, such as x86_64-linux, and the ending of shared libraries.

    Raises
    ------
    ParameterError
        The platform has no name.
    """
    system, machine = platform.system(), platform.machine()
    if system not in SYSTEMS or machine.lower() not in MACHINES:
        raise ParameterError(
            f"`fmu`: this platform, {system} on {machine}, has no name in FMI 3.0; export the model on "
            "Linux, macOS or Windows with a 64-bit processor"
        )
    name, ending = SYSTEMS[system]
    return f"{MACHINES[machine.lower()]}-{name}", ending


def compiler() -> list[str]:
    """Return the command of the C compiler: that of the variable CC, or cc, gcc or clang.

    Raises
    ------
    ParameterError
        There is none.
    """
    named = os.environ.get("CC", "")
    words = shlex.split(named)
    if words:
        if shutil.which(words[0]):
            return words
        raise ParameterError(f"`fmu`: the C compiler of the variable CC, {named}, was not found; correct CC")
    for name in ("cc", "gcc", "clang"):
        if found := shutil.which(name):
            return [found]
    raise ParameterError(
        "`fmu`: an FMU contains a compiled library, and no C compiler was found (cc, gcc, clang). Install "
        "one, for example with `apt install gcc`, `xcode-select --install` or `winget install LLVM.LLVM`, or "
        "set the variable CC to its command. `--c` writes the source code without a compiler"
    )


def shared_library(sources: list[Path], target: Path) -> None:
    """Compile C99 sources to a shared library.

    Raises
    ------
    ParameterError
        There is no compiler, or it refuses the sources.
    """
    position = [] if platform.system() == "Windows" else ["-fPIC", "-fvisibility=hidden"]
    flags = ["-std=c99", "-O2", "-shared", *position]
    command = [*compiler(), *flags, "-o", str(target), *map(str, sources)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ParameterError(f"`fmu`: the C compiler does not work: {error}") from error
    if done.returncode != 0:
        said = " ".join((done.stderr or done.stdout).split())[:300]
        raise ParameterError(
            f"`fmu`: the C compiler `{command[0]}` failed with {done.returncode}: {said}. Set the variable "
            "CC to another compiler"
        )
