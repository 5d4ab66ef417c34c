"""`gpi reproduce`: published examples and benchmarks, run again."""

import typer

from gpi_hammerstein.cli.reproduce.paper import paper_command
from gpi_hammerstein.cli.reproduce.steering_mirror import steering_mirror_command

reproduce: typer.Typer = typer.Typer(no_args_is_help=True, help="Run published examples again.")


@reproduce.callback()
def _examples() -> None:
    """Run published examples again."""


reproduce.command("paper")(paper_command)
reproduce.command("fsm")(steering_mirror_command)
