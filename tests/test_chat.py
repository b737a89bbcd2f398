"""Chat templates: text never becomes markup, and models that refuse roles."""

import pytest

from goalscope.models.chat import ChatTemplate
from goalscope.types import Message, ModelError


def test_a_template_without_system_messages_gets_the_text_in_the_users_first() -> None:
    source = (
        "{% if messages[0].role == 'system' %}{{ raise_exception('no system') }}{% endif %}"
        "{% for m in messages %}[{{ m.role }}]{{ m.content | trim }}{% endfor %}[assistant]"
    )
    template = ChatTemplate(source, "", "")
    assert template.layout([Message("system", "Be brief."), Message("user", "Hi")]) == [
        "[user]",
        Message("user", "Be brief.\n\nHi"),
        "[assistant]",
    ]


def test_a_template_that_refuses_the_roles_is_an_error() -> None:
    template = ChatTemplate("{{ raise_exception('roles must alternate') }}", "", "")
    with pytest.raises(ModelError, match="roles must alternate"):
        template.layout([Message("user", "Hi"), Message("user", "Hello?")])


def test_a_template_that_drops_a_message_is_an_error() -> None:
    template = ChatTemplate("{{ messages[-1].content }}", "", "")
    with pytest.raises(ModelError, match="leaves a message out"):
        template.layout([Message("user", "Hi"), Message("user", "Hello?")])
