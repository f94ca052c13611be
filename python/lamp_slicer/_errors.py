"""Exceptions and warnings of lamp_slicer. Their sentences are those of the program."""


class LampError(Exception):
    """Bad input, or a failure on the way: the sentence says what, where, and what to do."""


class LampSettingsError(LampError, ValueError):
    """Keywords contradict each other or their input: others may work."""


class LampFileError(LampError, OSError):
    """A file cannot be read or written. `errno` has the system's number, if there is one."""


class LampFileNotFoundError(LampFileError, FileNotFoundError):
    """There is no such file."""


class LampWarning(UserWarning):
    """Something to look at. The program prints it, too."""


class LampNote(LampWarning):
    """Something worth knowing. `warnings.simplefilter("ignore", LampNote)` silences notes."""


for _class in (LampError, LampSettingsError, LampFileError, LampFileNotFoundError, LampWarning, LampNote):
    _class.__module__ = "lamp_slicer"
