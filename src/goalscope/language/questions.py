"""What a question is about, by its nearest phrasing, for an adapter that was not taught it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from goalscope.base.arrays import Floats
from goalscope.base.nouns import names, singular, singulars, words
from goalscope.base.text import is_question
from goalscope.language.orders import Order
from goalscope.models.embedding import summed, unit

PHRASINGS: Mapping[str, str] = {
    "done": """what did you do, what have you done so far, what have you been up to, tell me
    what you changed, what happened just now, did you touch it, what have you done with it, what
    did you move, what did you turn on, what did you open, list your actions, did you do that,
    did it work, have you done it yet""",
    "added": """what did you add, what have you added so far, tell me what you added, what did
    you put in the basket, did you add it, have you added it yet, did you put it in, did it go
    in""",
    "removed": """what did you take out, what did you throw out, which items got removed, what
    is gone, what is missing now, did you remove it, did you take it away, have you taken it
    out, is it out, did you get rid of it, is it still there""",
    "guessed": """what did you guess, which are your guesses, what did you add that I did not
    ask for, what is in there that I never asked for, anything in the basket that I did not
    order, what did you add on your own, which were your ideas, what did you add without asking
    me, what did you do unasked, what did you assume, did you add anything extra, which did I
    not ask for, what have you put in there by yourself""",
    "why": """why is it in the basket, why is it in there, why did you do that, why did you
    add it, why did you put it in, why did you take it out, why did you remove it, why not, how
    come it is there, how come it is in the basket, what made you pick it, what is it for, what
    is it there for, what are they for, what is the one for, what is it in the basket for, what
    do we need it for, what will I use it for, since when is it there, since when are they in
    there, why is it on the table, why are they in the basket, why are there any, when did you
    add it, did I ask for it, did I ask for that, did I order it, who asked for it, who ordered
    it, was it my idea, how did it get in there""",
    "asked": """what did I ask for, what did I ask you to do, what did I order, what did I tell
    you to get, what have I told you so far, repeat what I asked for, what do you know about me,
    what do you remember, what are my wishes, what did I rule out, which limits did I set""",
    "any": """is there any in the basket, is there any of it in there, is it in the basket, is
    there anything with it in it, do I have it, do I already have it, is any of that made of it,
    any alcohol in there, does this contain gluten""",
    "total": """how much is that now, how much is it in all, how much is it altogether, what is
    the total, total price, what does it come to, what will it cost me altogether, how much will
    I pay, what do I owe you, what is my bill, am I over my budget, how much money is left, how
    much can I still spend, how much for everything""",
    "count": """how many of it are in there, how many are in the basket, how many items is that,
    number of things in the basket, how many have I got, count them""",
    "enough": """is that enough for ten people, will it be enough for the four of us, does that
    feed a family of five, have we got enough of it for six, is one enough, do I have enough,
    how many people does it feed, how many servings is that, will that do for twelve guests, do
    they serve four""",
    "abilities": """what can you do, what can you do for me, what can I ask you, how does this
    work, how do I use this, what are my options, what commands are there, who are you, what are
    you, help me""",
    "undo": """what would undo take back, what happens if I say undo, what can be undone,
    what could I take back, what would you undo""",
    "goal": """what do you think I want, what do you think I am after, what do you think I am
    making, what is my goal, how sure are you, are you sure about that, what else could it be,
    why do you still think it is, what makes you say that""",
    "": """how much is it, how much are they, what does it cost, how much does it cost,
    could you undo it, please undo that, do you have it, have you got it, got any, what kinds of
    it do you have, where is it, where are they, is it on, is it gluten free, what is in it,
    what is in the basket, what is in the basket right now, what is on it now, what is still on
    it, what is lying around, which things are in it, which things are in the, what things are in
    this room, what is dirty in here, which room is this, are we in the, show me the basket, list
    the basket, what do you have, what is there, what is the, what about it, tell me about it,
    what kind of it is it, which is best, can you recommend one, how big is it, what is on offer,
    what time do you close, what colour is it""",
}
"""Examples of each kind, with commas between; "it" stands for the thing."""

_NEAR = 0.4
"""Nearness below which a question asks for facts."""

_COUNT = 2
"""Nearest phrasings of a kind that count."""


def told_about(orders: Iterable[Order], said: str) -> tuple[Order, ...]:
    """The orders of an utterance, each question with what it is about.

    A thing that only earlier words named counts where facts are asked for: "how much is it?". Words
    that were read as an undo may only ask what that would do.
    """
    orders = tuple(orders)
    asked = [each for each in orders if each.do == "ask"]
    undoes = is_question(said) and any(each.do == "undo" for each in orders)
    if not (asked or undoes):
        return orders
    about = about_of(said, [name for each in asked for name in (each.what, each.where)])
    if about == "undo" and undoes:
        return (Order("ask", about="undo"),)

    def told(thing: str) -> str:
        return thing if not about or names(said, thing) else ""

    return tuple(
        replace(each, what=told(each.what), where=told(each.where), about=about)
        if each.do == "ask"
        else each
        for each in orders
    )


def about_of(said: str, things: Sequence[str] = ()) -> str:
    """What an utterance is after, by its words without those of the things that it names."""
    named = {word for thing in things for word in singulars(thing)}
    rest = " ".join(word for word in words(said) if singular(word) not in named)
    vector = _vectors([rest])[0]
    near: list[tuple[float, str]] = [
        (float(np.sort(examples @ vector)[-_COUNT:].mean()), about)
        for about, examples in _known().items()
    ]
    nearness, about = max(near)
    return about if nearness >= _NEAR else ""


@cache
def _known() -> dict[str, Floats]:
    return {about: _vectors(listed.split(",")) for about, listed in PHRASINGS.items()}


def _vectors(texts: Sequence[str]) -> Floats:
    """[N, 256] of length one; a word weighs the root of its length, lest "basket" hide "why"."""
    rows = [summed(words(text) or ["?"]) for text in texts]
    roots = [np.sqrt(np.linalg.norm(row, axis=1, keepdims=True)) for row in rows]
    weighed = [
        (row / np.where(root > 0, root, 1)).sum(0) for row, root in zip(rows, roots, strict=True)
    ]
    return unit(np.stack(weighed))
