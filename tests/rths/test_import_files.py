"""Files of other programs: a text is read whatever it is called by a logger, and all else is refused by what it is."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import InputError
from report.text.tabular import read_table
from report.text.text_form import StatedForm

TEXT = "t\tu\n0.0\t1.5\n0.1\t-2.5\n"
LABVIEW = (
    "LabVIEW Measurement\t\nSeparator\tTab\nDate\t2024/02/29\nTime\t13:01:02.123456\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\nY_Unit_Label\tmm\tkN\t\nDelta_X\t0.010000\t0.010000\t\n***End_of_Header***\t\t\t\n"
    "X_Value\tDisp\tForce\tComment\n"
)


def archive(*names: str) -> bytes:
    """A zip archive with empty parts."""
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        for name in names:
            file.writestr(name, "")
    return stream.getvalue()


OTHERS = {
    "xlsx": (
        archive("[Content_Types].xml", "xl/workbook.xml"),
        "is an Excel workbook (.xlsx): open it in Excel",
    ),
    "xlsb": (archive("xl/workbook.bin"), "is an Excel workbook (.xlsb)"),
    "xls": (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600), "is an Excel workbook of before 2007 (.xls)"),
    "ods": (archive("mimetype", "content.xml"), "is an OpenDocument spreadsheet (.ods)"),
    "zip": (archive("data.csv"), "is a zip archive: unpack it"),
    "tdms": (b"TDSm" + bytes(60), "is a TDMS file of LabVIEW"),
    "h5": (b"\x89HDF\r\n\x1a\n" + bytes(60), "is an HDF5 file"),
    "mat": (b"MATLAB 7.3 MAT-file, by".ljust(512) + b"\x89HDF\r\n\x1a\n", "is a MATLAB file of version 7.3"),
    "hdf5": (bytes(512) + b"\x89HDF\r\n\x1a\n", "is an HDF5 file"),
    "gz": (b"\x1f\x8b\x08" + bytes(20), "is compressed by gzip"),
    "damaged": (archive("data.csv")[:30], "is a zip archive that is damaged"),
}


@pytest.mark.parametrize("other", OTHERS)
@pytest.mark.parametrize("ending", ["", ".csv"])
def test_a_file_of_another_program_is_refused_by_what_it_is_under_any_name(
    other: str, ending: str, tmp_path: Path
) -> None:
    content, said = OTHERS[other]
    path = tmp_path / f"data.{other}{ending}"
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        read_table(path)
    text = str(refused.value)
    assert said in text
    assert text.startswith(f"{path} is ")
    assert text.endswith(".")
    assert "\n" not in text


@pytest.mark.parametrize("ending", [".dat", ".asc", ".txt", ".tsv", ".lvm", ".DAT"])
def test_texts_are_read_under_the_names_that_loggers_give_them(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"data{ending}"
    path.write_text(TEXT)
    assert read_table(path).columns["u"].tolist() == [1.5, -2.5]


@pytest.mark.parametrize("ending", [".dat", ".csv", ".lvm"])
def test_a_file_of_bytes_under_the_name_of_a_text_is_refused(ending: str, tmp_path: Path) -> None:
    path = tmp_path / f"data{ending}"
    path.write_bytes(np.arange(50.0).tobytes())
    with pytest.raises(InputError, match="is no text, although its name ends in"):
        read_table(path)


def test_a_text_under_the_name_of_a_workbook_may_be_renamed(tmp_path: Path) -> None:
    path = tmp_path / "data.xls"
    path.write_text(TEXT)
    with pytest.raises(
        InputError, match=r"is unknown: give .*; a text with a table of numbers may end in \.txt\.$"
    ):
        read_table(path)


def test_a_missing_file_is_said_to_be_missing(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="There is no file"):
        read_table(tmp_path / "data.xlsx")


@pytest.mark.parametrize("first", ["", "\t", "\tbegin of the test"])
@pytest.mark.parametrize("later", ["", "\t"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_rows_of_labview_leave_out_the_column_of_comments(
    first: str, later: str, end: str, tmp_path: Path
) -> None:
    rows = (f"{0.01 * k:.6f}\t{0.1 * k:.3f}\t{k}.5{later if k else first}\n" for k in range(300))
    path = tmp_path / "data.lvm"
    path.write_bytes((LABVIEW + "".join(rows)).replace("\n", end).encode())
    found: Any = read_table(path, StatedForm(columns=("X_Value", "Disp"))).columns
    assert found["X_Value"] == pytest.approx(0.01 * np.arange(300))
    assert found["Force"] == pytest.approx(np.arange(300) + 0.5)
