"""Run notebooks and write what they show into them, and nothing else: `make notebooks`."""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def remake(path: Path) -> None:
    """Run a notebook in its folder; leave its cells' tags and its kernel as its only metadata."""
    book = nbformat.read(path, as_version=4)
    here = {"metadata": {"path": str(path.parent)}}
    NotebookClient(book, timeout=600, record_timing=False, resources=here).execute()
    book.metadata = nbformat.from_dict({"kernelspec": KERNEL, "language_info": {"name": "python"}})
    for cell in book.cells:
        cell.metadata = {"tags": cell.metadata["tags"]} if "tags" in cell.metadata else {}
    nbformat.write(book, path)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        remake(Path(name))
