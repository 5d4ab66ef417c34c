"""`gpi reproduce`: reproduce published examples and benchmarks."""

import typer

from gpi_hammerstein.cli.reproduce.paper import paper_command
from gpi_hammerstein.cli.reproduce.steering_mirror import steering_mirror_command

reproduce: typer.Typer = typer.Typer(no_args_is_help=True, help="Reproduce published examples.")


@reproduce.callback()
def _examples() -> None:
    """Reproduce published examples."""


reproduce.command("paper")(paper_command)
reproduce.command("fsm")(steering_mirror_command)
