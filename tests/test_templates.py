"""Chat templates of today's families: where given words stand, and where a reply begins."""

from __future__ import annotations

from datetime import datetime
from types import SimpleNamespace

import pytest

from goalscope.base.types import Message, ModelError
from goalscope.models.chat import ChatTemplate, opens_thought
from goalscope.models.check import check
from goalscope.models.llama.model import LlamaCpp

CHATML = (
    "{% for m in messages %}<|im_start|>{{ m.role }}\n{{ m.content }}<|im_end|>\n{% endfor %}"
    "{% if add_generation_prompt %}<|im_start|>assistant\n{% endif %}"
)
QWEN3 = """\
{%- set ns = namespace(last=0) %}
{%- for m in messages if m.role == 'user' %}{% set ns.last = messages.index(m) %}{% endfor %}
{%- for m in messages %}
    {%- set content = m.content.split('</think>')[-1].lstrip('\\n') %}
    {%- if m.role == 'assistant' and loop.index0 > ns.last %}
        {{- '<|im_start|>assistant\\n<think>\\n\\n</think>\\n\\n' + content + '<|im_end|>\\n' }}
    {%- else %}
        {{- '<|im_start|>' + m.role + '\\n' + content + '<|im_end|>\\n' }}
    {%- endif %}
{%- endfor %}
{%- if add_generation_prompt %}
    {{- '<|im_start|>assistant\\n' }}
    {%- if enable_thinking is defined and enable_thinking is false %}
        {{- '<think>\\n\\n</think>\\n\\n' }}
    {%- endif %}
{%- endif %}"""
QWEN3_THINKING = QWEN3[: QWEN3.rindex("    {%- if enable")] + (
    "    {{- '<think>\\n' }}\n{%- endif %}"
)
QWEN3_5 = QWEN3.replace("    {%- endif %}\n{%- endif %}", (
    "    {%- else %}{{- '<think>\\n' }}\n    {%- endif %}\n{%- endif %}"
))  # fmt: skip
R1 = """\
{{- bos_token }}
{%- for m in messages %}
    {%- if m.role == 'system' %}{{- m.content }}
    {%- elif m.role == 'user' %}{{- '<|User|>' + m.content }}
    {%- else %}{{- '<|Assistant|>' + m.content.split('</think>')[-1] + '<|end|>' }}
    {%- endif %}
{%- endfor %}
{%- if add_generation_prompt %}{{- '<|Assistant|><think>\\n' }}{% endif %}"""
LLAMA = """\
{{- bos_token }}
{%- if not date_string is defined %}
    {%- if strftime_now is defined %}{% set date_string = strftime_now('%d %b %Y') %}
    {%- else %}{% set date_string = '26 Jul 2024' %}{% endif %}
{%- endif %}
{%- if messages[0].role == 'system' %}
    {%- set said = messages[0].content|trim %}{% set messages = messages[1:] %}
{%- else %}{% set said = '' %}{% endif %}
{{- '<|start_header_id|>system<|end_header_id|>\\n\\nToday Date: ' + date_string }}
{{- '\\n\\n' + said + '<|eot_id|>' }}
{%- for m in messages %}
    {{- '<|start_header_id|>' + m.role + '<|end_header_id|>\\n\\n' }}
    {{- m.content|trim + '<|eot_id|>' }}
{%- endfor %}
{%- if add_generation_prompt %}
    {{- '<|start_header_id|>assistant<|end_header_id|>\\n\\n' }}
{%- endif %}"""
SMOLLM3 = """\
{%- if enable_thinking is not defined %}{% set enable_thinking = true %}{% endif %}
{%- set mode = '/think' if enable_thinking else '/no_think' %}
{%- if messages[0].role == 'system' %}
    {%- set said = messages[0].content %}{% set messages = messages[1:] %}
{%- else %}{% set said = 'You are a helpful assistant.' %}{% endif %}
{{- '<|im_start|>system\\nToday Date: ' + strftime_now('%d %B %Y') + '\\nReasoning Mode: ' + mode }}
{{- '\\n\\n' + said + '<|im_end|>\\n' }}
{%- for m in messages %}
    {%- if m.role == 'assistant' %}
        {%- generation %}
            {%- set thought = '' if mode == '/think' else '<think>\\n\\n</think>\\n' %}
            {{- '<|im_start|>assistant\\n' + thought + m.content.lstrip('\\n') + '<|im_end|>\\n' }}
        {%- endgeneration %}
    {%- else %}{{- '<|im_start|>' + m.role + '\\n' + m.content + '<|im_end|>\\n' }}
    {%- endif %}
{%- endfor %}
{%- if add_generation_prompt %}
    {{- '<|im_start|>assistant\\n' + ('' if mode == '/think' else '<think>\\n\\n</think>\\n') }}
{%- endif %}"""
GEMMA = """\
{{- bos_token }}
{%- if messages[0].role == 'system' %}{{ raise_exception('System role not supported') }}{% endif %}
{%- for m in messages %}
    {%- if (m.role == 'user') != (loop.index0 % 2 == 0) %}
        {{- raise_exception('Conversation roles must alternate') }}
    {%- endif %}
    {%- set role = 'model' if m.role == 'assistant' else m.role %}
    {{- '<start_of_turn>' + role + '\\n' + m.content|trim + '<end_of_turn>\\n' }}
{%- endfor %}
{%- if add_generation_prompt %}{{ '<start_of_turn>model\\n' }}{% endif %}"""
MISTRAL = """\
{%- if messages[0].role == 'system' %}
    {%- set said = messages[0].content + '\\n\\n' %}{% set messages = messages[1:] %}
{%- else %}{% set said = '' %}{% endif %}
{{- bos_token }}
{%- for m in messages %}
    {%- if m.role == 'user' %}
        {{- '[INST] ' + (said if loop.last else '') + m.content + '[/INST]' }}
    {%- else %}{{- ' ' + m.content + eos_token }}
    {%- endif %}
{%- endfor %}"""
HARMONY = """\
{{- '<|start|>system<|message|>Current date: ' + strftime_now('%Y-%m-%d') + '<|end|>' }}
{%- for m in messages %}
    {%- if m.role == 'assistant' %}
        {{- '<|start|>assistant<|channel|>final<|message|>' + m.content + '<|end|>' }}
    {%- else %}{{- '<|start|>' + m.role + '<|message|>' + m.content + '<|end|>' }}
    {%- endif %}
{%- endfor %}
{%- if add_generation_prompt %}<|start|>assistant{% endif %}"""
COMMAND = """\
{%- for m in messages %}
    {%- if m.role == 'assistant' %}{{- '<|BOT|><|START_TEXT|>' + m.content + '<|END_TEXT|>' }}
    {%- else %}{{- '<|' + m.role + '|>' + m.content }}
    {%- endif %}
{%- endfor %}
{%- if add_generation_prompt %}{{- '<|BOT|><|START_THINKING|>' }}{% endif %}"""
STEPS = """\
{%- for m in messages %}{{- '<|' + m.role + '|>\\n' + m.content + '\\n' }}{% endfor %}
{%- if add_generation_prompt %}
    {{- '<|assistant|>\\nHere are my reasoning steps:\\n' }}
{%- endif %}"""

# Of each template, what stands before given words, and before a reply where that differs.
FAMILIES = {
    "Qwen2.5": (CHATML, "<|im_start|>assistant\n", ""),
    "Qwen3": (QWEN3, "<|im_start|>assistant\n", "<think>\n\n</think>\n\n"),
    "Qwen3-Thinking": (QWEN3_THINKING, "<|im_start|>assistant\n", "<think>\n\n</think>\n\n"),
    "Qwen3.5": (QWEN3_5, "<|im_start|>assistant\n", "<think>\n\n</think>\n\n"),
    "DeepSeek-R1": (R1, "<|Assistant|>", "<think>\n\n</think>\n\n"),
    "Llama-3.1": (LLAMA, "<|start_header_id|>assistant<|end_header_id|>\n\n", ""),
    "SmolLM3": (SMOLLM3, "<|im_start|>assistant\n<think>\n\n</think>\n", ""),
    "Gemma": (GEMMA, "<start_of_turn>model\n", ""),
    "gpt-oss": (HARMONY, "<|start|>assistant<|channel|>final<|message|>", ""),
    "Command": (COMMAND, "<|BOT|><|START_TEXT|>", ""),
    "Apriel": (STEPS, "<|assistant|>\n", ""),
}
CHAT = [
    Message("system", "You want tea."),
    Message("user", "Hello?"),
    Message("assistant", "Hi."),
    Message("user", "What would you like?"),
]
OFF = {"enable_thinking": False, "thinking": False, "thinking_budget": 0}


def shown(template: str, chat: list[Message], *, writing: bool = False) -> str:
    pieces = ChatTemplate(template, "<s>", "</s>").layout(chat, writing=writing)
    return "".join(each if isinstance(each, str) else each.content for each in pieces)


@pytest.mark.parametrize("family", FAMILIES)
def test_words_stand_where_the_templates_history_has_them(family: str) -> None:
    template, before_words, more = FAMILIES[family]
    prompt, writing = shown(template, CHAT), shown(template, CHAT, writing=True)
    assert prompt.endswith(before_words)
    assert before_words + "Hi." in prompt  # the same as in the history
    assert writing == prompt + more
    assert not opens_thought(prompt)
    assert not opens_thought(writing)


def test_the_space_before_earlier_words_stands_before_given_ones_alone() -> None:
    assert shown(MISTRAL, CHAT).endswith("[INST] You want tea.\n\nWhat would you like?[/INST] ")
    assert shown(MISTRAL, CHAT, writing=True).endswith("What would you like?[/INST]")


def rendered(template: str, chat: list[Message], *, reply: bool) -> str:
    """The chat as Transformers renders it, on the day that goalscope tells templates."""
    utils = pytest.importorskip("transformers.utils.chat_template_utils")
    utils.datetime = SimpleNamespace(now=lambda: datetime(2024, 7, 26))
    messages = [{"role": each.role, "content": each.content} for each in chat]
    try:
        (text,), _ = utils.render_jinja_template(
            [messages], chat_template=template, add_generation_prompt=reply,
            bos_token="<s>", eos_token="</s>", **OFF,
        )  # fmt: skip
    finally:
        utils.datetime = datetime
    return text


@pytest.mark.parametrize("family", FAMILIES)
def test_a_prompt_is_what_transformers_renders(family: str) -> None:
    template, _, _ = FAMILIES[family]
    chat = CHAT[1:] if family == "Gemma" else CHAT
    after = [*chat, Message("assistant", "Some tea."), Message("user", "Here.")]
    assert rendered(template, after, reply=False).startswith(shown(template, chat) + "Some tea.")
    its = rendered(template, chat, reply=True)
    writing = shown(template, chat, writing=True)
    if opens_thought(its):
        assert its.startswith(writing) or writing.startswith(its)
    elif family not in ("gpt-oss", "Apriel", "Command"):  # thoughts in marks of their own
        assert writing == its


def test_the_prompt_does_not_depend_on_the_day() -> None:
    assert "Today Date: 26 Jul 2024" in shown(LLAMA, CHAT)
    assert "Today Date: 26 July 2024" in shown(SMOLLM3, CHAT)


@pytest.mark.parametrize(
    ("opening", "closing"),
    [
        ("<think>", "</think>"),
        ("<think>\n", "\n</think>\n\n"),
    ],
)
def test_a_thought_that_nothing_switches_off_is_closed(opening: str, closing: str) -> None:
    template = (
        "{% for m in messages %}[{{ m.role }}]{{ m.content }}{% endfor %}"
        "{% if add_generation_prompt %}[assistant]" + opening + "{% endif %}"
    )
    assert shown(template, CHAT) == shown(template, CHAT, writing=True).removesuffix(
        opening + closing
    )
    always = template.replace("{{ m.content }}", opening + "{{ m.content }}")
    assert shown(always, CHAT).endswith(opening + closing)


def test_a_template_that_refuses_the_answer_in_the_middle_is_used_by_its_reply() -> None:
    template = (
        "{% if messages[-1].role == 'user' and messages|length > 5 %}{{ raise_exception('no') }}"
        "{% endif %}{% for m in messages %}[{{ m.role }}]{{ m.content }}{% endfor %}"
        "{% if add_generation_prompt %}[assistant]<think>{% endif %}"
    )
    assert shown(template, CHAT).endswith("[assistant]<think></think>")


def test_a_function_that_is_missing_is_not_taken_for_a_refusal_of_roles() -> None:
    for chat in (CHAT, CHAT[1:]):
        with pytest.raises(ModelError, match=r"cannot be used \('today' is undefined\)"):
            shown("{{ today() }}" + CHATML, chat)


def test_the_self_test_notices_words_within_a_thought(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("goalscope.models.chat._closed", lambda markup: markup + "<think>\n")
    with_thought = LlamaCpp()
    try:
        found, problems = check(with_thought)
    finally:
        with_thought.close()
    assert "words would be scored as part of it" in " ".join(problems)
    assert found["scored words follow"].endswith(r"assistant\n<think>\n'")


def test_an_empty_chat_is_the_header_of_a_reply() -> None:
    default = "{% if messages and messages[0].role != 'system' %}[default]{% endif %}"
    assert shown(default + CHATML, []) == "<|im_start|>assistant\n"
