"""The notebook of the documentation runs, and draws what it says."""

import os
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from PIL import Image

NOTEBOOK = Path(__file__).parent.parent / "examples" / "stl_to_picture.ipynb"


def test_the_notebook_goes_from_an_stl_to_a_picture(tmp_path, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    # A notebook without outputs shows the same after each change.
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(cell.outputs == [] and cell.execution_count is None for cell in cells)
    resources = {"metadata": {"path": str(tmp_path)}}
    NotebookClient(notebook, timeout=120, kernel_name="python3", resources=resources).execute()
    texts = "".join(output.get("text", "") for cell in cells for output in cell.outputs)
    assert "slice 100 layers" in texts and "bool" in texts
    for name in ["layer.png", "areas.png"]:
        with Image.open(tmp_path / name) as picture:
            assert len(picture.convert("RGB").getcolors(1 << 24)) > 10
    assert "ring.tif" in os.listdir(tmp_path)
