"""Chat templates: text never becomes markup, and models that refuse roles."""

import re

import pytest

from goalscope.base.types import Message, ModelError
from goalscope.models.chat import ChatTemplate, ChatTokenizer


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


def test_a_turn_ends_at_its_token_and_not_at_the_space_before_it() -> None:
    words = ["</s>", "<s>", " ", "[", "x", "]"]

    def encode(text: str, *, markup: bool) -> list[int]:
        found = re.findall("</s>|<s>|." if markup else ".", text)
        return [words.index(each) if each in words else 4 for each in found]

    def tokenizer(template: str, eos: int = 0) -> ChatTokenizer:
        return ChatTokenizer(
            encode,
            lambda tokens, markup: "".join(words[token] for token in tokens),
            template=template,
            bos=(1, "<s>"),
            eos=(eos, "</s>"),
            add_bos=True,
            names=["<s>", "</s>"],
            controls={0, 1},
        )

    llama2 = (
        "{% for m in messages %}{% if m.role == 'user' %}[{{ m.content }}]"
        "{% else %} {{ m.content }} {{ eos_token }}{% endif %}{% endfor %}"
    )
    assert tokenizer(llama2).end_of_turn == 0
    no_end = "{% for m in messages %}[{{ m.content }}]{% endfor %}"
    assert tokenizer(no_end, eos=1).end_of_turn == 1
    with pytest.raises(ModelError, match="No token ends"):
        tokenizer(no_end, eos=-1)


@pytest.mark.parametrize("content", ["{{ m.content[0].text }}", "{{ m.content / 2 }}", ""])
def test_a_template_that_fails_in_its_own_way_is_an_error(content: str) -> None:
    template = ChatTemplate("{% for m in messages %}" + content + "{% endfor %}", "", "")
    with pytest.raises(ModelError, match=r"cannot be used|refuses"):
        template.after_assistant()
    with pytest.raises(ModelError, match=r"cannot be used|refuses"):
        template.layout([Message("user", "Hi")])


def test_a_template_that_drops_a_message_is_an_error() -> None:
    template = ChatTemplate("{{ messages[-1].content }}", "", "")
    with pytest.raises(ModelError, match="leaves a message out"):
        template.layout([Message("user", "Hi"), Message("user", "Hello?")])
