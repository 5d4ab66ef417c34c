"""`gpi app`: the whole way from a record to a model in a browser."""

from typing import Annotated

import typer

from gpi_hammerstein.cli.output import console, escape


def app(
    browser: Annotated[
        bool,
        typer.Option(
            "--browser/--no-browser", help="Open the page in the browser, or only print its address."
        ),
    ] = True,
) -> None:
    """Show a page in the browser: drop a record, search, read the report, save the model.

    The page and its data stay on this machine: the server listens on 127.0.0.1 only, and no file is sent
    elsewhere. What you do not download is removed when the app ends.

    Needs the extra `app`: pip install 'gpi-hammerstein[app]'. The environment variable GPI_MAX_UPLOAD_BYTES
    is the largest size of one file (268435456).
    """
    from gpi_hammerstein.app import require_libraries

    require_libraries()
    from gpi_hammerstein.app.server import serve

    screen = console()

    def say(address: str) -> None:
        screen.print(f"The app is at {escape(address)}")
        screen.print("Press Ctrl-C to end it.")

    serve(open_browser=browser, say=say)
