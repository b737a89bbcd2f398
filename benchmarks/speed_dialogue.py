"""What the speed benchmark reads: a shop's task, 20 rounds of a dialogue, 500 distinct goals."""

from __future__ import annotations

import itertools
import random

from goalscope.base.types import UNSPECIFIED, Goal, Turn

TASK = "Help the human to buy groceries in an online shop, and fill the basket with what they want."

TURNS = [
    Turn(*pair)
    for pair in (
        (
            "Hello! What can I help you find in the shop today?",
            "Hi, I'm having some friends over on Saturday and I want to cook dinner for them.",
        ),
        (
            "That sounds lovely. How many people will there be at the table?",
            "Six of us, or maybe seven if my brother manages to catch the early train.",
        ),
        (
            "Do you already have a dish in mind, or would you like some ideas?",
            "Something warm that I can put in the oven before they come, so I'm not stuck at the "
            "stove all evening.",
        ),
        (
            "An oven dish, good. Is there anything that one of your guests can't eat?",
            "Anna is vegetarian, and one of the others gets a rash from peanuts.",
        ),
        (
            "Thank you, I will leave out meat and peanuts. Are eggs and cheese fine for Anna?",
            "Yes, cheese is fine, she loves it. The more the better, to be honest.",
        ),
        (
            "Would you rather have pasta, potatoes or rice in the dish?",
            "Pasta, I think. We had potatoes the last time and nobody finished them.",
        ),
        (
            "Should the sauce be with tomatoes, or a white one with cream?",
            "Tomatoes, with plenty of garlic and some fresh basil on top.",
        ),
        (
            "Which vegetables shall I add? We have aubergines, courgettes, spinach and peppers.",
            "Aubergines and spinach, please. I don't like peppers when they are cooked that long.",
        ),
        (
            "Would you like a salad or some bread to go with it?",
            "A green salad, and two of those long crusty loaves if they are still warm.",
        ),
        (
            "What should the salad have in it besides the leaves?",
            "Cucumber, a few walnuts, and a simple dressing with lemon and olive oil.",
        ),
        (
            "I have noted that. What would you like your guests to drink?",
            "A bottle or two of red wine, nothing fancy, and sparkling water for the drivers.",
        ),
        (
            "We have an organic red from Sicily at nine euros. Would that suit you?",
            "Nine is alright, but I'd take the cheaper one if it isn't too sweet.",
        ),
        (
            "Then I suggest the dry house red at six euros. Do you want a dessert as well?",
            "Yes, something with fruit. My mother used to make a crumble with apples and berries.",
        ),
        (
            "A crumble it is. Do you have flour, butter and sugar at home?",
            "There's flour and sugar, but I'm out of butter, and I need oats for the topping.",
        ),
        (
            "Shall I put in fresh berries, or frozen ones, which cost about half as much?",
            "Frozen is fine for baking. Please take the ones without any added sugar.",
        ),
        (
            "Would you like cream, custard or ice cream on the side?",
            "Vanilla ice cream, but make sure there are no traces of peanuts in it.",
        ),
        (
            "I found one that is made without nuts. How much may all of this cost you?",
            "I'd like to stay below eighty euros if we can, with the wine included.",
        ),
        (
            "So far it comes to sixty-eight euros. Is there anything for the morning after?",
            "Good point, two of them stay the night, so coffee, milk and a dozen eggs.",
        ),
        (
            "Ground coffee or whole beans? And which kind of milk do you use?",
            "Ground, for a filter machine, and oat milk, since the other upsets my stomach.",
        ),
        (
            "All of that is in the basket now. When should we bring it to your door?",
            "Saturday before noon would be perfect, so that I have the afternoon for cooking.",
        ),
    )
]

_ERRANDS = (
    "Cook {dish} for {people}",
    "Buy everything needed for {dish}, enough for {people}",
    "Surprise {people} with {dish}",
    "You want to make {dish} at home for {people}",
    "Find cheap ingredients for {dish} to feed {people}",
)
_DISHES = (
    "a vegetable lasagne", "fish tacos", "red lentil soup", "blueberry pancakes", "chicken curry",
    "salmon sushi", "ratatouille", "chili sin carne", "pad thai", "a Sunday roast", "falafel wraps",
    "beef stew", "mushroom risotto", "a chocolate birthday cake", "miso ramen", "a Greek salad",
    "pizza margherita", "beef stroganoff", "shakshuka", "seafood gumbo",
)  # fmt: skip
_PEOPLE = (
    "six friends on Saturday evening", "two small children", "a table of ten colleagues",
    "your parents, who come for lunch", "yourself and one hungry neighbour",
)  # fmt: skip
_WISHES = (
    "without spending more than thirty euros", "without any nuts", "with only organic products",
    "without gluten or lactose", "in less than half an hour", "with leftovers for Monday",
    "without meat or fish",
)  # fmt: skip


def _all_goals() -> list[Goal]:
    errands = itertools.product(_ERRANDS, _DISHES, _PEOPLE)
    texts = [
        f"{errand.format(dish=dish, people=people)}, {_WISHES[i % len(_WISHES)]}."
        for i, (errand, dish, people) in enumerate(errands)
    ]
    random.Random(0).shuffle(texts)
    return [Goal(text) for text in texts]


ALL_GOALS = _all_goals()


def goals(count: int) -> list[Goal]:
    """The first `count` goals and, as in a `GoalTracker`, the person with no stated goal."""
    return [UNSPECIFIED, *ALL_GOALS[:count]]
