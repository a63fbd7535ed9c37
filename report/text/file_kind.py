"""What a file is by its first bytes, where it is none that can be read: its name may say something else."""

from __future__ import annotations

import zipfile
from pathlib import Path

HEAD = 1024  # bytes: a MATLAB file of version 7.3 has its mark of HDF5 behind 512
ZIP = b"PK\x03\x04"
HDF5 = b"\x89HDF\r\n\x1a\n"
SHEET = "open it in Excel or LibreOffice and save the sheet with the data as CSV"
# by the first bytes of a file what it is, and what to do
BEGINNINGS = {
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1": f"an Excel workbook of before 2007 (.xls): {SHEET}",
    b"TDSm": "a TDMS file of LabVIEW: export its channels as CSV, by DIAdem or by Python's package npTDMS",
    b"MATLAB 7.3": "a MATLAB file of version 7.3: load it in MATLAB and save it with the option '-v7'",
    HDF5: "an HDF5 file: write its arrays as columns of a CSV file, by Python's package h5py or MATLAB's h5read",
    b"\x1f\x8b": "compressed by gzip: decompress it by gunzip and give the file within",
    b"BZh": "compressed by bzip2: decompress it by bunzip2 and give the file within",
    b"7z\xbc\xaf\x27\x1c": "a 7z archive: unpack it and give the file within",
    b"Rar!\x1a\x07": "a RAR archive: unpack it and give the file within",
}
# by the name of a part of a zip archive
WITHIN = {
    "xl/workbook.xml": f"an Excel workbook (.xlsx): {SHEET}",
    "xl/workbook.bin": f"an Excel workbook (.xlsb): {SHEET}",
    "content.xml": f"an OpenDocument spreadsheet (.ods): {SHEET}",
}
ARRAYS = ".npy"  # ending of the parts of an .npz
WIDE = (b"\xff\xfe", b"\xfe\xff")  # how a text of two bytes for each character begins


def unreadable(path: Path) -> str:
    """What a file is that cannot be read as a table, and what to do, as the end of a sentence; empty for others.

    Raises:
        OSError: the file cannot be opened.
    """
    with path.open("rb") as file:
        head = file.read(HEAD)
    if head.startswith(ZIP):
        return of_archive(path)
    found = (said for begin, said in BEGINNINGS.items() if head.startswith(begin))
    return next(found, BEGINNINGS[HDF5] if HDF5 in head else "")


def of_archive(path: Path) -> str:
    """As `unreadable`, of a zip archive."""
    try:
        with zipfile.ZipFile(path) as archive:
            names = archive.namelist()
    except zipfile.BadZipFile:
        return "a zip archive that is damaged: copy it again"
    if names and all(name.endswith(ARRAYS) for name in names):
        return ""
    found = (said for name, said in WITHIN.items() if name in names)
    return next(found, "a zip archive: unpack it and give the file within")


def is_text(path: Path) -> bool:
    """Whether a file seems to be a text: it has no zero bytes, or the mark of a text with two bytes a character."""
    with path.open("rb") as file:
        head = file.read(HEAD)
    return head.startswith(WIDE) or b"\0" not in head
