"""A Sphinx extension: a container of the class `gallery` gets the pictures of its page as thumbnails.

Each thumbnail links to the section that draws the picture. The pictures are those of the executed page, so
that the gallery cannot differ from it.
"""

from docutils import nodes
from sphinx.application import Sphinx


def pictures(page: nodes.document) -> list[tuple[nodes.section, nodes.image]]:
    """Return the sections that contain no other section, each with its first picture."""
    innermost = [section for section in page.findall(nodes.section) if not has_sections(section)]
    first = [(section, next(section.findall(nodes.image), None)) for section in innermost]
    return [(section, image) for section, image in first if image is not None]


def has_sections(section: nodes.section) -> bool:
    """Return whether a section contains another one."""
    return any(isinstance(child, nodes.section) for child in section.children)


def thumbnail(section: nodes.section, image: nodes.image) -> nodes.paragraph:
    """Return a picture and the title of its section as a link to the section."""
    title = section.next_node(nodes.title).astext()
    small = image.deepcopy()
    small["alt"] = title
    link = nodes.reference(
        "", "", small, nodes.inline(text=title), internal=True, refuri=f"#{section['ids'][0]}"
    )
    return nodes.paragraph("", "", link)


def fill(app: Sphinx, page: nodes.document, name: str) -> None:
    """Add the thumbnails to the galleries of a page."""
    for container in page.findall(nodes.container):
        if "gallery" in container["classes"]:
            cards = nodes.container(classes=["thumbnails"])
            cards += [thumbnail(*picture) for picture in pictures(page)]
            container += cards


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the extension."""
    app.connect("doctree-resolved", fill)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
