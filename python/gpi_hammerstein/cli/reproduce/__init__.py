"""`gpi reproduce`: reproduce published examples and benchmarks."""

import typer

from gpi_hammerstein.cli.help import Command, Group
from gpi_hammerstein.cli.reproduce.paper import paper_command
from gpi_hammerstein.cli.reproduce.public import command
from gpi_hammerstein.cli.reproduce.steering_mirror import steering_mirror_command
from gpi_hammerstein.reproduce.catalogue import BENCHMARKS

reproduce: typer.Typer = typer.Typer(cls=Group, no_args_is_help=True, help="Reproduce published examples.")


@reproduce.callback()
def _examples() -> None:
    """Reproduce published examples."""


reproduce.command("paper", cls=Command)(paper_command)
reproduce.command("fsm", cls=Command)(steering_mirror_command)
for _name in BENCHMARKS:
    reproduce.command(_name, cls=Command)(command(_name))
