"""Rules of the code base that a test can check."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections import Counter
from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter
from importlib import metadata
from pathlib import Path

from rths.__main__ import VERBS, check_home
from tests.helpers import ROOT
from tests.processes import HANG_S

README = (ROOT / "README.md").read_text()
# what a reader takes in at a look: files of a folder, lines of a function, parameters of a function
MOST_FILES, MOST_LINES, MOST_PARAMETERS = 15, 60, 8


def tracked() -> list[Path]:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    return [ROOT / name for name in listed.stdout.split("\n") if name and (ROOT / name).is_file()]


def test_the_readme_names_commands_and_files_that_exist() -> None:
    verbs = set(re.findall(r"`?rths ([a-z]+)\b(?!/)", README)) - {"and"}
    assert verbs <= set(VERBS), verbs - set(VERBS)
    assert {verb for verb in VERBS if f"rths {verb}" in README} == set(VERBS)
    for link in re.findall(r"\]\(([^)]+)\)", README):
        assert (ROOT / link.partition("#")[0]).exists(), link
    for row in re.findall(r"^\| (`.+?/`) \|", README, flags=re.MULTILINE):
        for folder in re.findall(r"`(.+?)/`", row):
            assert (ROOT / folder).is_dir(), folder


def test_the_readme_describes_each_folder() -> None:
    folders = {path.relative_to(ROOT).parts[0] for path in tracked() if path.parent != ROOT}
    rows = re.findall(r"^\| (`.+?/`) \|", README, flags=re.MULTILINE)
    named = {folder for row in rows for folder in re.findall(r"`(.+?)/`", row)}
    assert named == {folder for folder in folders if not folder.startswith(".")}


def test_the_readme_begins_with_the_two_commands_and_the_output_of_the_first() -> None:
    head = README[: README.index("## The loop")]
    assert "make run" in head
    assert "make test" in head
    assert "master      20000     20000        0   none" in head
    assert "outcome: completed" in head


def test_the_readme_has_at_most_900_words() -> None:
    assert len(README.split()) <= 900


def test_no_public_text_names_a_registry_or_a_path_of_a_machine() -> None:
    registries = re.compile(
        "|".join(["pypi" + r"\.org", "files" + r"\.pythonhosted", "npmjs" + r"\.", "/" + "work/main"])
    )
    for path in tracked():
        if path.suffix not in (".mcap", ".AT2", ".npz", ".png"):
            found = registries.search(path.read_text(encoding="utf-8"))
            assert found is None, f"{path}: {found}"


def test_the_lock_pins_every_dependency_with_a_hash() -> None:
    lock = "".join(path.read_text() for path in sorted(ROOT.glob("*.lock")))
    for requirement in metadata.requires("rths") or []:
        name = re.split(r"[<>=; \[]", requirement)[0].lower()
        assert re.search(rf"^{re.escape(name)}==", lock, flags=re.MULTILINE), name
    assert lock.count("--hash=sha256:") > lock.count("==")


def test_the_command_runs_with_its_own_packages() -> None:
    assert check_home() == ""


def test_another_package_named_common_on_the_path_is_reported_in_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "common").mkdir()
    for file in (ROOT / "common").glob("*.py"):
        (tmp_path / "common" / file.name).write_text(file.read_text())
    found = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys; from rths.__main__ import main; sys.argv = ['rths', 'inspect']; sys.exit(main())",
        ],
        cwd=tmp_path,
        env={"PYTHONPATH": f"{tmp_path}:{ROOT}", "PATH": "/usr/bin:/bin"},
        capture_output=True,
        text=True,
        timeout=HANG_S,
    )
    assert found.returncode == 2
    assert found.stderr.startswith("rths: another package named 'common'")


def test_no_files_import_each_other_in_a_circle() -> None:
    """Imports for type checkers and within functions count too, since a reader follows them alike."""
    files = {place.relative_to(ROOT).as_posix() for place in tracked() if place.suffix == ".py"}
    names = {name[:-3].removesuffix("/__init__").replace("/", "."): ROOT / name for name in files}
    ties = {name: imported(path, names) - {name} for name, path in names.items()}
    assert circle(ties) == []
    assert circle(ties | {"common.errors": {"rths.__main__"}}) != []  # the check finds one


def circle(ties: Mapping[str, set[str]]) -> list[str]:
    """The modules of a circle of imports, from one of them back to it; empty if there is none."""
    try:
        TopologicalSorter(ties).prepare()
    except CycleError as error:
        return list(error.args[1])
    return []


def imported(path: Path, known: Mapping[str, Path]) -> set[str]:
    """The project's modules from which a file imports anything."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            for alias in node.names:
                whole = f"{node.module}.{alias.name}"
                found.add(whole if whole in known else str(node.module))
    return found & known.keys()


def test_folders_functions_and_signatures_stay_within_their_limits() -> None:
    product = [
        path for path in tracked() if path.suffix == ".py" and path.relative_to(ROOT).parts[0] in rooms()
    ]
    folders = Counter(path.parent for path in product if path.name != "__init__.py")
    assert {str(folder): count for folder, count in folders.items() if count > MOST_FILES} == {}
    bodies, signatures = {}, {}
    for path in product:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                where = f"{path.relative_to(ROOT)}:{node.lineno} {node.name}"
                bodies[where] = (node.end_lineno or node.lineno) - node.body[0].lineno + 1
                names = [one.arg for one in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
                signatures[where] = len([name for name in names if name not in ("self", "cls")])
    assert {where: lines for where, lines in bodies.items() if lines > MOST_LINES} == {}
    assert {where: count for where, count in signatures.items() if count > MOST_PARAMETERS} == {}


def rooms() -> set[str]:
    """The folders of the product, as the import contract names them."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        return set(tomllib.load(file)["tool"]["importlinter"]["root_packages"])
