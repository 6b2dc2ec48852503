"""What a page may say."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rig.errors import FormatError
from rig.view.commands import Command, parse


def test_commands_of_the_page_are_understood():
    assert parse('{"ack": 12}') == Command(ack=12)
    assert parse('{"want": ["views", "slope"], "freeze": true}') == Command(
        want=frozenset({"views", "slope"}), freeze=True
    )
    assert parse('{"do": "record"}').do == "record"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no command of the live page"),
        ("[]", "no command"),
        ('{"ack": -1}', "ack: Input should be greater than or equal to 0"),
        ('{"ack": "1"}', "ack: Input should be a valid integer"),
        ('{"want": ["everything"]}', "want.0: Input should be 'views'"),
        ('{"do": "format"}', "do: Input should be 'save'"),
        ('{"run": "rm"}', "run: Extra inputs are not permitted"),
    ],
)
def test_anything_else_is_refused_and_told(text: str, told: str):
    with pytest.raises(FormatError, match=told):
        parse(text)


@given(st.text(max_size=80) | st.binary(max_size=80))
def test_no_rubbish_gets_through(text: str | bytes):
    try:
        found = parse(text)
    except FormatError as error:
        assert "no command of the live page" in error.found
    else:
        assert found == Command()
