"""Run notebooks and write what they show into them, and nothing else: `make notebooks`."""

import sys
import tempfile
from pathlib import Path
from uuid import uuid4

import nbformat
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from traitlets import default

KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


class OverFiles(AsyncKernelManager):
    """A kernel that is spoken to over sockets in files: of TCP ports two kernels that start at once may choose one."""

    @default("transport")
    def _files(self) -> str:
        return "ipc"

    @default("connection_file")
    def _short(self) -> str:  # sockets have its name, of 100 letters at most
        return str(Path(tempfile.gettempdir()) / f"kernel-{uuid4().hex[:12]}.json")


def remake(path: Path) -> None:
    """Run a notebook in its folder; leave its cells' tags and its kernel as its only metadata."""
    book = nbformat.read(path, as_version=4)
    here = {"metadata": {"path": str(path.parent)}}
    NotebookClient(book, timeout=600, record_timing=False, resources=here, kernel_manager_class=OverFiles).execute()
    book.metadata = nbformat.from_dict({"kernelspec": KERNEL, "language_info": {"name": "python"}})
    for cell in book.cells:
        cell.metadata = {"tags": cell.metadata["tags"]} if "tags" in cell.metadata else {}
    nbformat.write(book, path)


if __name__ == "__main__":
    for name in sys.argv[1:]:
        remake(Path(name))
