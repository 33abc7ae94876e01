"""Two notebooks run at once in tests: TCP ports are chosen before they are bound, and two kernels may choose one."""

import tempfile
from pathlib import Path
from uuid import uuid4

import nbmake.nb_run
from jupyter_client.manager import AsyncKernelManager
from nbclient import NotebookClient
from traitlets import default


class OverFiles(AsyncKernelManager):
    """A kernel that is spoken to over sockets in files."""

    @default("transport")
    def _files(self) -> str:
        return "ipc"

    @default("connection_file")
    def _short(self) -> str:  # sockets have its name, of 100 letters at most
        return str(Path(tempfile.gettempdir()) / f"kernel-{uuid4().hex[:12]}.json")


class Client(NotebookClient):
    @default("kernel_manager_class")
    def _over_files(self) -> type[AsyncKernelManager]:
        return OverFiles


nbmake.nb_run.NotebookClient = Client  # it has no option for it
