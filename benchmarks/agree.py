"""Print log-likelihoods, a belief and a reading, to compare two machines byte by byte.

Run `python benchmarks/agree.py > here.txt` on both, then `cmp`. Floats are in hexadecimal.
"""

from __future__ import annotations

from goalscope.base.types import UNSPECIFIED, Goal, Turn
from goalscope.belief.belief import Belief
from goalscope.belief.likelihood import RolePlay
from goalscope.envs.grocery.catalogue import Catalogue
from goalscope.envs.grocery.shop import GroceryShop
from goalscope.language.reader import reader_of
from goalscope.models.opening import open_model

GOALS = [UNSPECIFIED, *map(Goal, ("bake a cake", "cook a soup", "feed a dog", "host a party"))]
TURNS = [
    Turn("What can I do for you?", "I need flour, sugar and a dozen eggs."),
    Turn("Anything else?", "Candles, and nothing with nuts please."),
]


def main() -> None:
    """Score two turns under five goals, update the belief, and read the words."""
    model, shop = open_model(), GroceryShop(Catalogue.load(None))
    table = RolePlay(model).log_likelihood(shop.task, GOALS, TURNS)
    for turn, row in zip(TURNS, table.tolist(), strict=True):
        print(turn.utterance, *map(float.hex, row))
    belief = Belief.uniform(GOALS)
    for row in table:
        belief = belief.observe(row)
    for goal, probability in belief.top():
        print(goal.text, float(probability).hex())
    reader = reader_of(model, shop.verbs, task=shop.task)
    for turn in TURNS:
        print(reader.read(turn.utterance, question=turn.query))


if __name__ == "__main__":
    main()
