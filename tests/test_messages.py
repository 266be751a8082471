# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of messages lists what the sources say, and each message is short."""

import ast

import pytest

from scripts import messages

MOST = 120
"""Letters of a message, without what is filled in: it stands in one line of the interface."""


def test_the_page_lists_what_the_sources_say() -> None:
    text = messages.PAGE.read_text(encoding="utf-8")
    assert messages.page(text) == text, "make messages writes it"
    assert text.count(messages.BEGIN) == text.count(messages.END) == 1


def test_a_message_is_one_short_line() -> None:
    found = messages.messages()
    assert len(found) > 150 and {item.kind for item in found} >= {"error", "warning", "grey"}
    assert [item for item in found if len(item.text) > MOST or "\n" in item.text] == []


def test_every_message_is_provoked_by_a_test():
    assert messages.unnamed() == []


@pytest.mark.parametrize(
    ("part", "is_named"),
    [
        ("Take the first of these", True),
        ("'Rock' of these: choose", True),
        ("Take them", False),
        ("of these", False),
    ],
)
def test_words_of_a_test_name_a_message_also_across_what_is_filled_in(part, is_named) -> None:
    assert messages.names(part, "Take the … of these: choose") == is_named


SAID = """
class OwnError(ValueError): pass

def advice():
    return f"Take {1} of these first"

def work(self, warnings):
    warnings += [f"Some {2} stayed behind"]
    warnings.append("Too long a name" if self else "Too short a name")
    self.report({"INFO"}, "All is well now")
    if self:
        raise OwnError(advice())
    raise KeyError("Nobody reads this one")
"""


def test_errors_reports_and_warnings_are_found(tmp_path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(messages, "ADDON", tmp_path)
    (tmp_path / "said.py").write_text(SAID)
    assert {(item.text, item.kind) for item in messages.messages()} == {
        ("Take … of these first", "error"),
        ("Some … stayed behind", "warning"),
        ("Too long a name", "warning"),
        ("Too short a name", "warning"),
        ("All is well now", "info"),
    }
    assert messages.text_of(ast.parse("'a' + name + f'{b} c'", mode="eval").body) == "a…… c"
