"""Export formats as data: a name, a description and a function that writes files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import PurePosixPath
from typing import TypeAlias

from missionc.base.diagnostics.code import EXTRA_MISSING, NOT_EXPORTED
from missionc.base.diagnostics.model import Diagnostic
from missionc.base.extensions import Kind, guard, rejected
from missionc.base.late_dataclass import Record
from missionc.output.export.verified_flight import Flight


class Exported(Record):
    """Files of an export by name, relative to the export's own folder, and notes for the user."""

    files: Mapping[str, bytes]
    notes: tuple[str, ...] = ()


Write: TypeAlias = Callable[[Flight], Exported | Diagnostic]


class Format(Record):
    """Export format: its name, its description, and the function that creates its files.

    Args:
        name: name on the command line, and of the folder.
        says: description in one line.
        write: function that writes the same bytes each time.
        needs: package of the extra ``export``, or empty.
    """

    name: str
    says: str
    write: Write
    needs: str = ""

    def missing(self) -> Diagnostic | None:
        """Diagnostic of a package that the format needs and that is not installed; None if there is none."""
        if not self.needs or find_spec(self.needs):
            return None
        return Diagnostic(
            EXTRA_MISSING,
            f"`--export {self.name}` needs the package {self.needs}, which is not installed",
            None,
            help="install it with `pip install 'missionc[export]'`",
        )

    def export(self, flight: Flight) -> Exported | Diagnostic:
        """Files of the flight in this format, or a diagnostic that states why there are none.

        Raises:
            ExtensionError: the format belongs to an extension, and returned something else.
        """
        with guard(Kind.EXPORT, self.name):
            made = self.missing() or self.write(flight)
            if isinstance(made, Diagnostic):
                return made
            if isinstance(made, Exported) and all(map(_is_file, made.files, made.files.values())):
                return made
        raise rejected(Kind.EXPORT, self.name, "wrote something other than a file of its folder")


def _is_file(name: object, content: object) -> bool:
    if not (isinstance(name, str) and isinstance(content, bytes)):
        return False
    path = PurePosixPath(name)
    return bool(path.name) and not path.is_absolute() and ".." not in path.parts


def refused(name: str, why: str, *notes: str, help: str) -> Diagnostic:
    """Diagnostic of a flight that the format cannot represent."""
    return Diagnostic(NOT_EXPORTED, f"the flight cannot be exported as `{name}`: {why}", None, notes=notes, help=help)
