"""The one error class of the package."""

from __future__ import annotations


class TetralodError(Exception):
    """Why a file, a mesh or a request cannot be used: what, where, and what to do.

    ``code`` says it in a word, for programs; the words are those of the JavaScript package:

    ======================= ==========================================================================
    ``bad-source``          the file is not there, or cannot be read
    ``network``, ``server`` the server cannot be reached, or sends something else than the file
    ``changed``             the file on the server was replaced while it was being read
    ``not-mt``              the bytes are no MT file
    ``unsupported-version`` the MT file was made by a later version
    ``corrupt``             a file contradicts itself or its checksums
    ``truncated``           a file ends too early
    ``limit``, ``memory``   a file needs more than is allowed
    ``bad-option``          an argument has an impossible value; the message names it
    ``not-ready``           the MT has been closed
    ``unknown-format``      the input is of no format that can be built from
    ``unsupported``         the input has something that cannot be read; the message says what to do
    ``bad-mesh``            the mesh cannot be built; the message says which cell or point, and why
    ``internal``            a mistake in this package: please report it
    ======================= ==========================================================================

    >>> import tetralod
    >>> try:
    ...     tetralod.open(b"no MT file")
    ... except tetralod.TetralodError as error:
    ...     print(error.code)
    not-mt
    """

    code: str

    def __init__(self, code: str, message: str) -> None:
        super().__init__(message)
        self.code = code

    def __reduce__(self) -> tuple[type[TetralodError], tuple[str, str]]:
        return type(self), (self.code, str(self))


def bad_option(name: str, problem: str) -> TetralodError:
    """The refusal of an argument."""
    return TetralodError("bad-option", f"option `{name}`: {problem}")
