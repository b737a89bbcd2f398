"""One thing under several names: what people call it, in the words of the shop."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from goalscope.words import singulars

__all__ = ["is_its_own", "translator", "usual"]

_GROUPS = """
bbq, barbecue
aubergine, eggplant
courgette, zucchini
clementine, satsuma, tangerine, mandarin
rocket, arugula
spring onion, green onion, scallion
beetroot, beet
mangetout, mange tout, snow pea
sweetcorn, sweet corn
corn on the cob, ear of corn, cob of corn, corn cob, sweet corn cob
green apple, granny smith apple
fresh coriander, fresh cilantro
coriander leaf, fresh cilantro
capsicum, bell pepper
cos lettuce, romaine lettuce
chestnut mushroom, cremini mushroom
garbanzo, garbanzo bean, chickpea
minced beef, beef mince, minced meat, mince, ground beef
lamb mince, minced lamb, ground lamb
pork mince, minced pork, ground pork
turkey mince, minced turkey, ground turkey
chicken mince, minced chicken, ground chicken
prawn, shrimp
gammon, ham
streaky bacon, smoked bacon
parmesan, parmesan cheese, parmigiano, parmigiano reggiano
semi skimmed milk, semi-skimmed milk, low-fat milk, low fat milk, 2% milk, 2% reduced-fat milk
skimmed milk, nonfat milk, non-fat milk, fat-free milk, skim milk
full fat milk, full-fat milk, full cream milk, whole milk
emmental, emmenthal, emmental cheese, swiss cheese
double cream, whipping cream, heavy cream, heavy whipping cream
soured cream, sour cream
yoghurt, yogurt
brown bread, wholemeal bread, wholewheat bread, whole meal bread, whole wheat bread
white bread, white loaf, sliced white bread, sliced white loaf, sliced loaf, white sandwich bread
brown loaf, whole wheat bread
cereal bar, granola bar
veggie burger, vegetarian burger, plant-based burger
burger bun, burger roll, hamburger roll, hamburger bun
hot dog roll, hotdog roll, hotdog bun, hot dog bun
bread roll, dinner roll
plain flour, all-purpose flour
wholemeal flour, wholewheat flour, whole wheat flour
strong flour, bread flour
cornflour, cornstarch, corn starch
icing sugar, confectioner's sugar, powdered sugar
granulated sugar, white sugar
demerara sugar, brown sugar
bicarbonate of soda, bicarb, baking soda
treacle, molasses
sultana, raisin
desiccated coconut, shredded coconut
vanilla essence, vanilla extract
hundreds and thousands, rainbow sprinkle
tin of tomatoes, tins of tomatoes, can of tomatoes, cans of tomatoes, tinned tomatoes, diced tomato
tin of beans, tins of beans, can of beans, cans of beans, tinned beans, canned beans, baked bean
tin of peas, tins of peas, can of peas, cans of peas, tinned peas, canned peas, canned green pea
canned tomatoes, chopped tomatoes, diced tomato
cake candle, birthday candle
tomato puree, tomato paste
stock cube, bouillon cube
vegetable stock, veggie stock, vegetable broth
chicken stock, chicken broth
beef stock, beef broth
mayo, mayonnaise
tomato ketchup, ketchup
porridge oat, porridge, oatmeal, rolled oat
crisps, potato crisp, potato chip
fizzy drink, soft drink, soda
coke, coca cola, cola
fizzy water, club soda, sparkling water
ice lolly, popsicle
oven chip, french fry
fish finger, fish stick
tp, loo roll, toilet roll, loo paper, toilet tissue, toilet paper
kitchen roll, kitchen towel, kitchen paper, paper towel
tissue, kleenex, facial tissue
nappy, diaper
washing up liquid, washing-up liquid, dishwashing liquid, dish soap
washing powder, laundry powder, laundry detergent
bin bag, bin liner, garbage bag, trash bag
cling film, clingfilm, saran wrap, plastic wrap
tin foil, tinfoil, kitchen foil, aluminium foil, aluminum foil
baking paper, greaseproof paper, parchment paper
serviette, napkin
plaster, band-aid, band aid, adhesive bandage
"""
"""Names of one thing, in the singular: a line for each thing."""

_USUAL = """
bread: white sandwich bread, white bread, whole wheat bread
rye: rye bread
coriander: fresh cilantro, ground coriander
rice: white rice, basmati rice
flour: all-purpose flour
pasta: egg pasta
cheese: cheddar cheese
cream: heavy whipping cream
oil: vegetable oil, sunflower oil
coffee: ground coffee, coffee beans
tea: breakfast tea bags, black tea bags, tea bags
wine: red wine
chocolate: milk chocolate bar, chocolate bar
chips: potato chips
cake: sponge cake, chocolate cake
cereal: corn flakes cereal
vinegar: white vinegar
syrup: maple syrup
jam: strawberry jam
icing: white icing
pea: green peas
bean: green beans
spinach: baby spinach
onion: yellow onions
potato: white potatoes, russet potatoes
tomato: roma tomatoes
peppers: bell peppers
pepper: ground black pepper
fish: cod fillets
cod: cod fillets
haddock: haddock fillets
salmon: salmon fillets
roll: dinner rolls
bun: hamburger buns
tortilla: flour tortillas
broth: vegetable broth
olive: green olives
plate: paper plates
wrap: spinach wraps
soap: hand soap
muffin: blueberry muffins
vanilla: vanilla extract
soda: lemon-lime soda
oatmeal: rolled oats
birthday cake: sponge cake, chocolate cake
pasta sauce: marinara pasta sauce
sauce: marinara pasta sauce
napkin: paper napkins
cup: paper cups, plastic cups
wipe: baby wipes
butter: unsalted butter, vegan butter
taco: taco shells
"""
"""What people mean who name no kind, the likeliest first; each is found by the bare word."""

_KINDS: dict[str, Sequence[str]] = {
    word: names.split(", ")
    for word, _, names in (line.partition(": ") for line in _USUAL.strip().splitlines())
}

_OF_ITS_OWN = frozenset({
    "burger", "caramel", "cider", "cocktail", "cupcake", "enchilada", "fajita", "hamburger",
    "fish", "margarine", "plantain", "razor", "stew", "sushi", "taco", "vodka",
})  # fmt: skip
"""Words for things that are not what shops name after them: no vodka is in "vodka sauce"."""


def translator(has: Callable[[str], bool]) -> Callable[[str], str]:
    """A function that says in the shop's words what people say in theirs.

    A name is changed where the shop has nothing by it, and has something by another one.

    Args:
        has: Whether the shop has anything by a name.
    """
    known: dict[tuple[str, ...], str] = {}
    for line in _GROUPS.strip().splitlines():
        names = line.split(", ")
        there = next((name for name in reversed(names) if has(name)), "")
        known |= {(*singulars(name),): there for name in names if there and not has(name)}
    longest = max(map(len, known), default=0)

    def translate(text: str) -> str:
        rest, said = singulars(text), list[str]()
        while rest:
            sizes = range(min(longest, len(rest)), 0, -1)
            size = next((size for size in sizes if (*rest[:size],) in known), 0)
            said.append(known[(*rest[:size],)] if size else rest[0])
            rest = rest[size or 1 :]
        return " ".join(said)

    return translate


def usual(phrase: str) -> Sequence[str]:
    """What people mean by `phrase` who name no kind: "bread" as "white sandwich bread"."""
    return _KINDS.get(phrase) or _KINDS.get(" ".join(singulars(phrase)), ())


def is_its_own(phrase: str) -> bool:
    """Whether things with `phrase` in their names are it only where they are named so last."""
    return not _OF_ITS_OWN.isdisjoint(singulars(phrase)[-1:])
