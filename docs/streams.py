"""A Sphinx extension: the pieces of an output are joined as they are.

A notebook receives the output of a `%%bash` cell in pieces of 100 bytes. MyST-NB puts a line break between
two pieces, also within a word.
"""

from myst_nb.core import render
from nbformat import NotebookNode
from sphinx.application import Sphinx

merge = render.coalesce_streams


def joined(outputs: list[NotebookNode]) -> list[NotebookNode]:
    """Return the outputs with one stream of each name, then in the order and form of MyST-NB."""
    streams: dict[str, NotebookNode] = {}
    kept = []
    for output in outputs:
        if output["output_type"] == "stream" and output["name"] in streams:
            streams[output["name"]]["text"] += output["text"]
            continue
        if output["output_type"] == "stream":
            streams[output["name"]] = output
        kept.append(output)
    return merge(kept)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    render.coalesce_streams = joined
    return {"parallel_read_safe": True, "parallel_write_safe": True}
