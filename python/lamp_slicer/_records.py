"""Reports as objects: JSON of the program, whose keys are attributes."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple, Optional

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from lamp_slicer._native import Layer


class Runs(NamedTuple):
    """An image as runs: each row is the sorted list of columns where its value changes.

    The changes of row `r` are at `columns[row_starts[r]:row_starts[r + 1]]`. Every row starts
    black. Without `levels`, each change toggles black and white; with them, it is to that level.
    """

    row_starts: NDArray[np.uint32]
    columns: NDArray[np.uint32]
    levels: Optional[NDArray[np.uint8]]


class Record(dict[str, Any]):
    """A JSON object. Its keys are attributes, too: `band.first_row` is `band["first_row"]`.

    The program's reports have the same keys. A key that a report leaves out raises AttributeError,
    and a key that is a method of dict, such as copy, is only an item: `record["copy"]`.
    """

    def __getattr__(self, key: str) -> Any:
        try:
            return self[key]
        except KeyError:
            raise AttributeError(f"the record has no {key!r}: it has {', '.join(self)}") from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self]

    def __repr__(self) -> str:
        return f"{type(self).__name__}({super().__repr__()})"


class Finding(Record):
    """A finding of a check: `kind`, `text` and the keys of its kind."""

    kind: str
    text: str

    def __str__(self) -> str:
        return f"{self.kind}: {self.text}"


class Feature(Record):
    """Findings that belong together, with the worst of them as `finding`.

    `severity` says how much they matter. `others` are the other findings of the same feature, and
    `alike` are findings that look like it elsewhere, as on the other copies of a part.
    """

    severity: str
    text: str
    finding: Finding
    others: list[Finding]
    alike: list[Finding]

    @property
    def kind(self) -> str:
        """The kind of the worst finding, such as `island`."""
        return self.finding.kind

    def __str__(self) -> str:
        return f"{self.kind}: {self.text}"


class Findings(list[Feature]):
    """What a check found, the worst first: a list of features.

    `needs_a_person` counts the features that are more than notes. `all` lists every finding,
    `specks` lists islands too small to matter, and `unchecked_rules` has a line for design rules that
    were not checked, with the reason.
    """

    layers: int
    needs_a_person: int
    all: list[Finding]
    specks: list[Finding]
    left_out: int
    note: Optional[str]
    unchecked_rules: list[str]
    reports: list[Record]

    def __init__(self, found: Record, reports: list[Record]) -> None:
        self.layers = found["layers"]
        self.needs_a_person = found["count"]
        self.left_out = found["left_out"]
        self.note = found["note"]
        self.unchecked_rules = found["unchecked_rules"]
        self.all = [Finding(finding) for finding in found["findings"]]
        self.specks = [Finding(speck) for speck in found["specks"]]
        self.reports = reports
        for feature in found["features"]:
            places = {"finding", "with", "alike"}
            made = Feature({key: value for key, value in feature.items() if key not in places})
            made["finding"] = self.all[feature["finding"]]
            made["others"] = [self.all[at] for at in feature.get("with", [])]
            made["alike"] = [self.all[at] for at in feature.get("alike", [])]
            self.append(made)

    def __repr__(self) -> str:
        return f"<lamp_slicer.Findings: {self.layers} layers, {self.needs_a_person} findings>"


class Plan(Record):
    """Bitmaps and times on a fixed glass, with the keys of the program's report.

    `layers` are the bitmaps in the order of their display: `array()` and `exposure_ms` of each, and
    `write` takes all of them. `target_um` and `cured_um` are the wanted and the cured height of each
    column of resin in micrometers, and `column_um` is the side of a column. Their first row has the
    greatest y, as images have.
    """

    layers: list[Layer]
    target_um: NDArray[np.float64]
    cured_um: NDArray[np.float64]
    column_um: float

    def __init__(
        self,
        report: Record,
        layers: list[Layer],
        target_um: NDArray[np.float64],
        cured_um: NDArray[np.float64],
        column_um: float,
    ) -> None:
        super().__init__(report)
        self.layers = layers
        self.target_um = target_um
        self.cured_um = cured_um
        self.column_um = column_um

    def __repr__(self) -> str:
        return f"<lamp_slicer.Plan: {self['target']}, {len(self.layers)} bitmaps>"


def records(text: str) -> Any:
    """Returns JSON text as objects."""
    return json.loads(text, object_hook=Record)


for _class in (Runs, Record, Finding, Feature, Findings, Plan):
    _class.__module__ = "lamp_slicer"
