"""Dietary restrictions: which ones a person names, and which items violate them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from goalscope.envs.grocery.catalogue import Item
from goalscope.envs.grocery.words import contains, singulars

__all__ = ["DIETS", "diet", "violates"]


@dataclass(frozen=True, slots=True)
class Diet:
    """One restriction.

    Attributes:
        said: Words by which a person names it, a regular expression.
        refused: What a person refuses who follows it ("no wheat", "allergic to wheat"), a
            regular expression; empty where refusing says nothing about a diet.
        harmless: Phrases that make any item fit, in the item's name.
        violating: Phrases that make an item violate it; every item does where this is empty.
        saving: Phrases to pass over before looking for violating ones.
    """

    said: str
    refused: str
    harmless: str
    violating: str
    saving: str = ""


_MEAT = (
    "beef, pork, chicken, turkey, lamb, veal, duck, bacon, ham, sausage, bratwurst, salami, "
    "pepperoni, chorizo, prosciutto, pancetta, mortadella, steak, meatball, hot dog, liver, "
    "brisket, rib, jerky, fish, salmon, tuna, cod, tilapia, haddock, trout, sardine, anchovy, "
    "mackerel, shrimp, prawn, crab, lobster, clam, mussel, oyster, scallop, squid, gelatin, "
    "bolognese, worcestershire, gummy, marshmallow, lard, caesar dressing"
)
_NO_MEAT = (
    "plant based, vegan, vegetarian, veggie, meatless, meat free, dog food, cat food, "
    "oyster mushroom, fish tank, fish flake"
)
_DAIRY = (
    "milk, butter, buttermilk, cream, cheese, yogurt, kefir, ghee, whey, ice cream, custard, "
    "pudding, mozzarella, parmigiano, parmesan, pecorino, grana padano, ricotta, mascarpone, "
    "burrata, halloumi, feta, brie, camembert, queso, half and half, alfredo, pesto, tiramisu, "
    "cheesecake, croissant, brioche, milk chocolate, truffle, caramel, frosting, quiche"
)
_PLANT_DAIRY = (
    "oat milk, almond milk, unsweetened almond milk, soy milk, coconut milk, rice milk, "
    "cashew milk, peanut butter, almond butter, cashew butter, seed butter, nut butter, "
    "cocoa butter, apple butter, butter bean, butter lettuce, coconut cream, coconut yogurt, "
    "soy yogurt, cream of tartar, cream of wheat, shaving cream, cream cracker"
)
_EGG = (
    "egg, mayonnaise, meringue, cake, muffin, brownie, cookie, waffle, pancake, donut, custard, "
    "quiche, cheesecake, tiramisu, ladyfinger, brioche, ranch, caesar"
)
_NO_EGG = (
    "eggplant, egg replacer, cake topper, cake pan, cake board, cake box, muffin tin, rice cake, "
    "cake flour"
)

DIETS: Mapping[str, Diet] = {
    "gluten-free": Diet(
        said=r"gluten[- ]?free|(?:o?eliac|celiac)|gluten (?:allergy|intoleran\w+)|wheat[- ]free",
        refused=r"gluten|wheat",
        harmless="gluten free, wheat free",
        violating=(
            "flour, bread, baguette, ciabatta, focaccia, loaf, sourdough, bun, roll, bagel, "
            "muffin, "
            "croissant, naan, pita, wrap, flour tortilla, wheat tortilla, crumpet, brioche, "
            "danish, "
            "donut, cake, cupcake, pie, brownie, cookie, biscuit, biscotti, shortbread, "
            "gingersnap, "
            "wafer, ladyfinger, panettone, tiramisu, cheesecake, cracker, pretzel, crouton, "
            "breadcrumb, crumb, pasta, spaghetti, penne, fusilli, rigatoni, linguine, farfalle, "
            "orecchiette, macaroni, lasagne, lasagna, fettuccine, tagliatelle, tortellini, "
            "ravioli, "
            "gnocchi, orzo, noodle, ramen, udon, couscous, bulgur, barley, wheat, rye, spelt, "
            "farro, "
            "semolina, farina, seitan, malt, beer, ale, lager, stout, soy sauce, teriyaki, hoisin, "
            "pizza, pastry, pie crust, phyllo, strudel, waffle, pancake, cake mix, brownie mix, "
            "muffin mix, pancake mix, cornbread, granola, muesli, bran, nugget, breaded, "
            "fish finger, "
            "burrito, spring roll, stuffing, licorice"
        ),
        saving=(
            "almond flour, coconut flour, rice flour, buckwheat flour, chickpea flour, corn flour, "
            "tapioca flour, potato flour, cassava flour, oat flour, rice noodle, glass noodle, "
            "rice cracker, rice cake, rice paper wrapper, pasta sauce, pizza sauce, ginger ale, "
            "root beer, ginger beer, cake topper, cake pan, cake board, cake box, cupcake liner, "
            "muffin tin, pie pan, pancake syrup, lentil pasta, chickpea pasta, toilet roll, "
            "loaf pan, bread knife, plastic wrap, cookie sheet"
        ),
    ),
    "vegan": Diet(
        said=r"vegan|plant[- ]based",
        refused=r"animal products",
        harmless="vegan, plant based",
        violating=f"{_MEAT}, {_DAIRY}, egg, mayonnaise, honey, meringue",
        saving=f"{_PLANT_DAIRY}, eggplant, egg replacer, {_NO_MEAT}",
    ),
    "vegetarian": Diet(
        said=r"vegetarians?|veggie (?:night|meal|dinner|option|version)|meat[- ]?(?:less|free)",
        refused=r"meat|meat or fish|fish or meat",
        harmless="vegetarian, vegan, plant based, meatless, meat free, veggie",
        violating=_MEAT,
        saving=_NO_MEAT,
    ),
    "dairy-free": Diet(
        said=r"(?:dairy|lactose|milk)[- ]?free|(?:lactose|dairy)[- ]intoleran\w+"
        r"|(?:dairy|milk) allergy",
        refused=r"dairy|lactose|milk products",
        harmless="dairy free, vegan, plant based, non dairy, lactaid free",
        violating=_DAIRY,
        saving=_PLANT_DAIRY,
    ),
    "nut-free": Diet(
        said=r"(?:pea)?nut[- ]?free|(?:tree |pea)?[- ]?nuts? allerg\w+",
        refused=r"(?:any )?(?:tree )?nuts|peanuts|peanuts and tree nuts",
        harmless="nut free, peanut free",
        violating=(
            "nut, peanut, almond, walnut, pecan, cashew, pistachio, hazelnut, macadamia, marzipan, "
            "praline, nougat, nutella, granola, trail mix, pesto"
        ),
        saving="nutmeg, coconut, donut, butternut",
    ),
    "egg-free": Diet(
        said=r"egg[- ]?free|egg allergy",
        refused=r"eggs?",
        harmless="egg free, vegan",
        violating=_EGG,
        saving=_NO_EGG,
    ),
    "organic": Diet(said=r"organic(?:ally)?", refused="", harmless="organic", violating=""),
    "halal": Diet(
        said=r"halal",
        refused="",
        harmless="halal",
        violating=(
            "pork, bacon, ham, prosciutto, pancetta, salami, pepperoni, chorizo, mortadella, lard, "
            "gelatin, gummy, marshmallow, beer, wine, beef, chicken, turkey, lamb, veal, steak, "
            "sausage, hot dog, liver, brisket, rib"
        ),
        saving=f"turkey baster, wine vinegar, root beer, ginger beer, non alcoholic, {_NO_MEAT}",
    ),
    "pork-free": Diet(
        said=r"pork[- ]free",
        refused=r"pork",
        harmless="pork free, halal, vegetarian, vegan",
        violating=(
            "pork, bacon, ham, prosciutto, pancetta, salami, pepperoni, chorizo, mortadella, lard, "
            "gelatin, bratwurst, guanciale"
        ),
        saving=f"turkey bacon, beef salami, {_NO_MEAT}",
    ),
    "sugar-free": Diet(
        said=r"sugar[- ]?free|(?:no|without) added sugar|diabetic|unsweetened",
        refused=r"(?:added |any )?sugars?",
        harmless="sugar free, unsweetened, no sugar added, zero sugar, diet",
        violating=(
            "sugar, honey, syrup, molasses, jam, jelly, marmalade, candy, cake, cookie, brownie, "
            "donut, muffin, pie, ice cream, frosting, icing, fondant, sprinkle, soda, cola, juice, "
            "lemonade, punch, chocolate, marshmallow, gummy, caramel, pudding, sorbet, ketchup"
        ),
        saving="sugar snap, cake pan, cake board, cake topper, rice cake, muffin tin, baking soda",
    ),
}
"""The restrictions by name; an item that carries the name as a tag fits."""

_REFUSING = (
    r"(?:no|without|avoid\w*|free of|free from|allerg\w+ to|intolerant to|skip|hates?"
    r"|(?:can'?t|cannot|can not|don'?t|doesn'?t|do not|does not|won'?t|shouldn'?t|must ?n[o']t)"
    r" (?:eat|have|tolerate|do|want|like|drink|use|touch|stand))"
)
_NOT = re.compile(
    r"(?:\bnot\b|n't\b|\bno longer\b|\bnobody\b|\bno one\b|\bwithout\b|\bno\b)(?:\s[\w-]+){0,4}\s*$"
)


def diet(utterance: str) -> frozenset[str]:
    """The restrictions of `DIETS` that a person names in `utterance`.

    "My son is allergic to peanuts" gives nut-free; "it need not be organic" gives nothing.
    """
    text = utterance.casefold().replace("\u2019", "'")
    return frozenset(name for name, entry in DIETS.items() if _is_named(entry, text))


def _is_named(entry: Diet, text: str) -> bool:
    for match in re.finditer(rf"\b(?:{entry.said})\b", text):
        clause = re.split(r"[.,;!?]|\bbut\b", text[: match.start()])[-1]
        if not _NOT.search(clause):
            return True
    return bool(entry.refused) and bool(
        re.search(
            rf"\b{_REFUSING} (?:any |the )?(?:[\w-]+(?:,? or |,? and |, )(?:any )?)*"
            rf"(?:{entry.refused})\b(?![- ]free)",
            text,
        )
    )


def violates(item: Item, restriction: str) -> bool:
    """Whether `item` violates `restriction`, a name in `DIETS`.

    Its tags decide where they can; otherwise the words of its name do.

    Raises:
        KeyError: `DIETS` has no such restriction.
    """
    entry = DIETS[restriction]
    if restriction in item.tags:
        return False
    name = set(singulars(item.name))
    if any(contains(name, phrase) for phrase in _phrases(entry.harmless)):
        return False
    if not entry.violating:
        return True
    saved = {w for p in _phrases(entry.saving) if contains(name, p) for w in p}
    return any(contains(name - saved, phrase) for phrase in _phrases(entry.violating))


def _phrases(listed: str) -> list[list[str]]:
    return [singulars(phrase) for phrase in listed.split(",") if phrase.strip()]
