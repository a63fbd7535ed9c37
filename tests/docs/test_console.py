"""The runner of documents runs the commands of a page and finds each difference from the text."""

from __future__ import annotations

from pathlib import Path

import pytest

from docs import console


def page(folder: Path, text: str) -> list[str]:
    """The places at which the commands of a page print something else than the page shows."""
    path = folder / "page.md"
    path.write_text(text, encoding="utf-8")
    (folder / "run").mkdir()
    return console.play(path, folder / "run")


def shown(*lines: str) -> str:
    """A console block."""
    return "\n".join(["```console", *lines, "```", ""])


def test_a_page_whose_outputs_are_right_passes(tmp_path: Path) -> None:
    assert page(tmp_path, shown("$ printf 'one\\ntwo\\n'", "one", "two", "$ true")) == []


def test_a_wrong_output_is_found_with_its_line_and_both_texts(tmp_path: Path) -> None:
    (complaint,) = page(tmp_path, "Text.\n\n" + shown("$ echo right", "wrong"))
    assert complaint == "line 3: echo right\n--- page\nwrong\n--- printed\nright\n"


@pytest.mark.parametrize("lines", [["one"], ["one", "two", "three"], [], ["two", "one"], ["one", "tw"]])
def test_an_added_missing_or_moved_line_is_found(tmp_path: Path, lines: list[str]) -> None:
    assert len(page(tmp_path, shown("$ printf 'one\\ntwo\\n'", *lines))) == 1


def test_standard_error_is_compared_with_the_page(tmp_path: Path) -> None:
    assert page(tmp_path, shown("$ echo trouble >&2", "trouble")) == []


def test_progress_lines_are_left_out_of_the_comparison(tmp_path: Path) -> None:
    lines = "running: ticks, 12 of 20, 5 s\\ndiagnosing: 9 s\\none\\nbroken: 3 m\\n"
    assert page(tmp_path, shown(f"$ printf '{lines}' >&2", "one", "broken: 3 m")) == []


def test_the_empty_line_after_a_progress_line_is_left_out(tmp_path: Path) -> None:
    assert page(tmp_path, shown("$ printf 'diagnosing: 9 s\\n\\nfound\\n'", "found")) == []


def test_a_command_that_fails_needs_its_exit_code_shown(tmp_path: Path) -> None:
    (complaint,) = page(tmp_path, shown("$ false"))
    assert "failed with 1" in complaint


def test_an_exit_code_that_is_shown_is_compared(tmp_path: Path) -> None:
    assert page(tmp_path, shown("$ (exit 3)", "$ echo $?", "3")) == []


def test_a_wrong_exit_code_is_found(tmp_path: Path) -> None:
    (complaint,) = page(tmp_path, shown("$ (exit 3)", "$ echo $?", "4"))
    assert complaint.endswith("--- page\n4\n--- printed\n3\n")


def test_a_command_that_ends_the_shell_is_found(tmp_path: Path) -> None:
    assert page(tmp_path, shown("$ exit 0", "$ echo after", "after"))


def test_a_command_may_span_lines_and_share_its_shell(tmp_path: Path) -> None:
    assert page(tmp_path, shown("$ for i in 1 2", "> do echo $i; done", "1", "2", "$ echo $i", "2")) == []


@pytest.mark.parametrize(
    ("expected", "printed", "agree"),
    [
        ("a … c\n", "a b c\n", True),
        ("a … c\n", "a b d\n", False),
        ("a … c\n", "a b\nb c\n", False),
        ("a\n…\nz\n", "a\nz\n", True),
        ("a\n…\nz\n", "a\nb\nc\nz\n", True),
        ("a\n…\nz\n", "a\nb\n", False),
        ("…\nb\n…\nd\n", "a\nb\nc\nd\n", True),
        ("…\nb\n…\nd\n", "d\nc\nb\na\n", False),
        ("1.5 mm  \n", "1.5 mm\n", True),
        ("1x5\n", "1.5\n", False),
        ("1.5\n", "1x5\n", False),
        ("a\n", "\na\n\n", True),
        ("", "", True),
        ("", "something\n", False),
        ("…\n", "", True),
    ],
)
def test_an_ellipsis_stands_for_anything_in_its_line_or_for_lines(
    expected: str, printed: str, agree: bool
) -> None:
    assert console.matches(expected, printed) is agree


def test_a_file_is_written_as_it_is_shown(tmp_path: Path) -> None:
    text = "<!-- file: plans/a.toml -->\n```toml\nx = 1\n\ny = 2\n```\n\n"
    assert page(tmp_path, text + shown("$ cat plans/a.toml", "x = 1", "", "y = 2")) == []


def test_a_block_with_a_terminal_runs_beside_the_next(tmp_path: Path) -> None:
    waits = shown("$ until test -f here; do sleep 0.05; done; echo found", "found")
    text = f"<!-- terminal: second -->\n{waits}\n{shown('$ touch here')}"
    assert page(tmp_path, text) == []


def test_a_wrong_output_in_another_terminal_is_found(tmp_path: Path) -> None:
    text = f"<!-- terminal: second -->\n{shown('$ echo b', 'a')}\n{shown('$ true')}"
    assert len(page(tmp_path, text)) == 1


def test_a_terminal_that_no_block_follows_is_awaited(tmp_path: Path) -> None:
    assert len(page(tmp_path, f"<!-- terminal: last -->\n{shown('$ echo b', 'a')}")) == 1


def test_a_command_that_hangs_is_ended_with_its_child_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(console, "TIMEOUT_S", 0.2)
    (complaint,) = page(tmp_path, shown("$ sleep 60 | sleep 60"))
    assert complaint.endswith("not done after 0.2 s")


@pytest.mark.parametrize("text", ["<!-- file: a -->\n\nText.\n", "<!-- terminal: a -->\n"])
def test_a_directive_without_a_block_is_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(ValueError, match="stands before no block"):
        page(tmp_path, text)


def test_a_console_block_that_begins_with_output_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="begins with"):
        page(tmp_path, shown("output", "$ true"))


def test_a_page_has_its_own_home_and_temporary_folder(tmp_path: Path) -> None:
    assert page(tmp_path, shown('$ test "$HOME" = "$PWD/.home" && test "$TMPDIR" = "$PWD/.tmp"')) == []


def test_the_command_runs_pages_and_prints_where_they_differ(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    good, bad = tmp_path / "good.md", tmp_path / "bad.md"
    good.write_text(shown("$ true"))
    bad.write_text(shown("$ echo a", "b"))
    monkeypatch.setattr("sys.argv", ["console", str(good)])
    assert console.main() == 0
    monkeypatch.setattr("sys.argv", ["console", str(good), str(bad)])
    assert console.main() == 1
    assert f"{bad}, line 1: echo a" in capsys.readouterr().out
