"""Dietary restrictions, and which items violate them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

from goalscope.envs.grocery.catalogue import Item
from goalscope.words import singulars

__all__ = ["DIETS", "Diet", "either", "finder", "violates"]


@dataclass(frozen=True, slots=True)
class Diet:
    """One restriction; its phrases stand in the singular, with commas between.

    Attributes:
        violating: Phrases that make an item violate it; every item does where this is empty.
        harmless: Phrases that make any item fit, in the item's name.
        refused: What a person refuses who follows it, as in "no wheat".
        allergens: What else an allergy calls for it by, as in "allergic to almonds".
        named: What people call what fits, besides its name, or what they are who need it.
        saving: Phrases to pass over before looking for violating ones.
        guessed: The stricter restriction that guesses keep to.
    """

    violating: str
    harmless: str
    refused: str = ""
    allergens: str = ""
    named: str = ""
    saving: str = ""
    guessed: str = ""


_FISH = (
    "fish, seafood, salmon, tuna, cod, tilapia, haddock, halibut, trout, sardine, anchovy, bass, "
    "pollock, hake, perch, pike, carp, eel, catfish, monkfish, swordfish, snapper, grouper, sole, "
    "turbot, plaice, mackerel, herring, caviar, roe, surimi, sushi, worcestershire, caesar"
)
_NO_FISH = "sushi rice, swedish fish, fish tank, fish flake"
_SHELLFISH = (
    "shellfish, seafood, shrimp, prawn, crab, lobster, crayfish, crawfish, langoustine, krill, "
    "scampi, clam, mussel, oyster, scallop, cockle, squid, calamari, octopus, surimi, paella"
)
_NO_SHELLFISH = "oyster mushroom, crab apple"
_LAND = (
    "beef, pork, chicken, turkey, lamb, veal, duck, bacon, ham, sausage, bratwurst, salami, "
    "pepperoni, chorizo, prosciutto, pancetta, mortadella, steak, meatball, hot dog, liver, "
    "brisket, rib, jerky, gelatin, bolognese, gummy, marshmallow, lard"
)
_MEAT = f"{_LAND}, {_FISH}, {_SHELLFISH}"
_MEATLESS = "vegetarian, vegan, plant based, meatless, meat free, veggie"
_NO_MEAT = f"dog food, cat food, {_NO_FISH}, {_NO_SHELLFISH}"
_BAKED = (
    "cake, cupcake, muffin, donut, doughnut, brownie, cookie, danish, cinnamon roll, pie, "
    "panettone, pancake, waffle, ladyfinger, tiramisu, cheesecake, brioche, quiche, lemon bar, "
    "biscotti"
)
_NO_BAKED = (
    "cake topper, cake pan, cake board, cake box, cake flour, rice cake, cupcake liner, "
    "english muffin, muffin tin, cookie sheet, cookie cutter, pie pan, pancake syrup"
)
_DAIRY = (
    "milk, butter, buttermilk, cream, cheese, yogurt, kefir, ghee, whey, casein, custard, "
    "pudding, mozzarella, cheddar, parmigiano, parmesan, pecorino, grana padano, ricotta, "
    "mascarpone, burrata, halloumi, feta, brie, camembert, queso, half and half, alfredo, pesto, "
    "croissant, shortbread, truffle, caramel, toffee, butterscotch, fudge, frosting, "
    "white chocolate, hot chocolate, chocolate spread, chocolate puff, candy coated chocolate, "
    "chocolate covered, protein bar, garlic bread, naan, ranch, caesar, ravioli, tortellini, "
    f"popper, artichoke dip, onion dip, vodka pasta sauce, pizza, lasagna, lasagne, {_BAKED}"
)
_PLANT_DAIRY = (
    "oat milk, almond milk, soy milk, coconut milk, rice milk, cashew milk, peanut butter, "
    "almond butter, cashew butter, seed butter, nut butter, cocoa butter, apple butter, "
    "butter bean, butter lettuce, coconut cream, coconut yogurt, soy yogurt, cream of tartar, "
    "cream of wheat, shaving cream, cream cracker, "
    "pizza dough, pizza crust, pizza base, pizza sauce, lasagna sheet, lasagne sheet, "
    f"lasagna noodle, {_NO_BAKED}"
)
_PORK = (
    "pork, bacon, ham, prosciutto, pancetta, salami, pepperoni, chorizo, mortadella, lard, "
    "gelatin, bratwurst, guanciale, italian sausage, breakfast sausage, kielbasa, andouille, "
    "speck, soppressata, spam"
)

DIETS: Mapping[str, Diet] = {
    "gluten-free": Diet(
        refused="gluten, wheat",
        named="gf, coeliac, celiac, without gluten",
        harmless="gluten free, wheat free",
        violating=(
            "flour, bread, baguette, ciabatta, focaccia, loaf, sourdough, bun, roll, bagel, "
            "muffin, croissant, naan, pita, wrap, tortilla, crumpet, brioche, quiche, danish, "
            "donut, doughnut, dough, cake, cupcake, pie, brownie, cookie, biscuit, biscotti, "
            "shortbread, gingersnap, wafer, ladyfinger, panettone, tiramisu, cheesecake, cracker, "
            "pretzel, crouton, breadcrumb, crumb, pasta, spaghetti, penne, fusilli, rigatoni, "
            "linguine, farfalle, orecchiette, macaroni, lasagne, lasagna, fettuccine, tagliatelle, "
            "tortellini, ravioli, gnocchi, orzo, noodle, ramen, udon, couscous, bulgur, barley, "
            "wheat, rye, spelt, farro, semolina, farina, seitan, malt, beer, ale, lager, stout, "
            "soy sauce, teriyaki, hoisin, pizza, pastry, phyllo, strudel, waffle, pancake, "
            "cornbread, granola, muesli, bran, nugget, breaded, fish finger, burrito, stuffing, "
            "licorice, oat, oatmeal, cereal, frosted flake, chocolate puff, lemon bar, minestrone, "
            "onion ring, mozzarella stick, popper, chicken tender, ice cream sandwich"
        ),
        saving=(
            "almond flour, coconut flour, rice flour, buckwheat flour, chickpea flour, corn flour, "
            "tapioca flour, potato flour, cassava flour, oat flour, corn tortilla, tortilla chip, "
            "oat milk, rice noodle, glass noodle, rice cracker, rice cake, rice paper wrapper, "
            "pasta sauce, pizza sauce, ginger ale, root beer, ginger beer, cake topper, cake pan, "
            "cake board, cake box, cupcake liner, muffin tin, pie pan, pancake syrup, "
            "lentil pasta, chickpea pasta, toilet roll, loaf pan, bread knife, plastic wrap, "
            "cookie sheet"
        ),
    ),
    "vegan": Diet(
        refused="animal product",
        named="plant based",
        harmless="vegan, plant based",
        violating=f"{_MEAT}, {_DAIRY}, egg, mayonnaise, honey, meringue",
        saving=f"{_PLANT_DAIRY}, egg replacer, {_NO_MEAT}",
    ),
    "vegetarian": Diet(
        named="veggie, veg, meatless, meat free",
        harmless=_MEATLESS,
        violating=_MEAT,
        saving=_NO_MEAT,
    ),
    "meat-free": Diet(
        refused="meat",
        named="pescatarian, pescetarian",
        harmless=_MEATLESS,
        violating=_LAND,
        saving=_NO_MEAT,
        guessed="vegetarian",
    ),
    "dairy-free": Diet(
        named="non dairy, lactose free",
        refused="dairy, dairy product, lactose, milk product",
        allergens="milk, cheese, casein, whey",
        harmless="dairy free, vegan, plant based, non dairy",
        violating=_DAIRY,
        saving=_PLANT_DAIRY,
    ),
    "nut-free": Diet(
        refused="nut, tree nut, peanut",
        allergens="almond, walnut, pecan, cashew, pistachio, hazelnut, macadamia",
        harmless="nut free, peanut free",
        violating=(
            "nut, peanut, almond, walnut, pecan, cashew, pistachio, hazelnut, macadamia, marzipan, "
            "praline, nougat, nutella, granola, trail mix, pesto, satay, baklava, amaretti"
        ),
    ),
    "egg-free": Diet(
        refused="egg",
        harmless="egg free, vegan",
        violating=(
            "egg, omelette, mayonnaise, meringue, custard, ranch, caesar, ravioli, tortellini, "
            f"{_BAKED}"
        ),
        saving=f"egg replacer, {_NO_BAKED}",
    ),
    "fish-free": Diet(
        refused="fish, seafood",
        allergens="salmon, tuna, cod, anchovy",
        harmless="fish free, vegan, vegetarian",
        violating=_FISH,
        saving=_NO_FISH,
    ),
    "shellfish-free": Diet(
        refused="shellfish, seafood",
        allergens="shrimp, prawn, crab, lobster, crustacean, mollusc, clam, mussel, oyster",
        harmless="shellfish free, vegan, vegetarian",
        violating=_SHELLFISH,
        saving=_NO_SHELLFISH,
    ),
    "soy-free": Diet(
        refused="soy, soya",
        allergens="soybean, tofu, edamame",
        harmless="soy free, soya free",
        violating=(
            "soy, soya, soybean, edamame, tofu, tempeh, miso, natto, tamari, teriyaki, hoisin, "
            "ponzu, worcestershire"
        ),
    ),
    "sesame-free": Diet(
        refused="sesame",
        allergens="tahini",
        harmless="sesame free",
        violating="sesame, tahini, halva, hummus, falafel, baba ghanoush, everything bagel",
    ),
    "organic": Diet(named="bio", harmless="organic", violating=""),
    "halal": Diet(
        harmless="halal",
        violating=(
            f"{_PORK}, gummy, marshmallow, beer, wine, beef, chicken, turkey, lamb, veal, steak, "
            "sausage, hot dog, liver, brisket, rib"
        ),
        saving=f"turkey baster, wine vinegar, root beer, ginger beer, non alcoholic, {_NO_MEAT}",
    ),
    "pork-free": Diet(
        refused="pork",
        harmless="pork free, halal, vegetarian, vegan",
        violating=_PORK,
        saving=f"turkey bacon, beef salami, {_NO_MEAT}",
    ),
    "sugar-free": Diet(
        refused="sugar, added sugar",
        named="diabetic, unsweetened, no added sugar, without sugar",
        harmless="sugar free, unsweetened, no sugar added, zero sugar, diet",
        violating=(
            "sugar, honey, syrup, molasses, jam, jelly, marmalade, candy, cake, cookie, brownie, "
            "donut, doughnut, muffin, pie, ice cream, frosting, icing, fondant, sprinkle, soda, "
            "cola, juice, lemonade, punch, chocolate, marshmallow, gummy, caramel, pudding, "
            "sorbet, ketchup"
        ),
        saving="sugar snap, cake pan, cake board, cake topper, rice cake, muffin tin, baking soda",
    ),
}
"""The restrictions by name; an item that carries the name as a tag fits."""


def violates(item: Item, restriction: str) -> bool:
    """Whether `item` violates `restriction`, a name in `DIETS`.

    Its tags decide where they can; otherwise the words of its name do.

    Raises:
        KeyError: `DIETS` has no such restriction.
    """
    entry = DIETS[restriction]
    if restriction in item.tags:
        return False
    name = " ".join(singulars(item.name))
    if finder(entry.harmless).search(name):
        return False
    if not entry.violating:
        return True
    return bool(finder(entry.violating).search(finder(entry.saving).sub("|", name)))


def either(listed: str) -> str:
    """A pattern of the listed phrases, longest first; it finds nothing where there is none."""
    phrases = [" ".join(singulars(p)) for p in listed.split(",") if p.strip()]
    return "|".join(sorted(phrases, key=len, reverse=True)) or "(?!)"


@cache
def finder(listed: str) -> re.Pattern[str]:
    """Finds any of the listed phrases as adjacent words."""
    return re.compile(rf"(?<!\S)(?:{either(listed)})(?!\S)")
