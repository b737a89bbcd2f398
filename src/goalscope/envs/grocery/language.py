"""What people order in the shop: its verbs, and readings that show them."""

from goalscope.orders import Example, Verb

__all__ = ["EXAMPLES", "VERBS"]

VERBS = (
    Verb("add", "put into the basket", ("what", "quantity", "for", "where")),
    Verb("remove", "take out of the basket", ("what", "quantity"), takes_away=True),
    Verb("set", "have exactly so many of it in the basket", ("what", "quantity")),
    Verb("swap", "take one thing out for another", ("what", "quantity", "for")),
    Verb("clear", "empty the basket", ()),
    Verb("buy", "buy the basket, now", (), irreversible=True),
)

EXAMPLES = (
    Example("Hi! I'd like to make a lasagne for my parents.", "aim"),
    Example(
        "we need 2 packs of lasagne sheets, half a kilo of minced beef and some parmesan",
        "add lasagne sheets | 2 pack\nadd minced beef | 0.5 kilo\nadd parmesan",
    ),
    Example("make the parmesan two", "set parmesan | 2"),
    Example(
        "my dad can't have nuts, they give him hives",
        "avoid nuts | for my dad | why allergy",
    ),
    Example("actually no beef, use soya mince instead", "swap minced beef | for soya mince"),
    Example("is the soya mince gluten free?", "ask soya mince"),
    Example("a dozen eggs, if they are free range", "add eggs | 1 dozen | if they are free range"),
    Example("maybe we could get wine, let me think", "none"),
    Example("it all has to be under 60 dollars", "budget | 60 dollar"),
    Example("everything organic please, I don't like the other stuff", "only organic | why taste"),
    Example("leave the eggs, take out the parmesan", "leave eggs\nremove parmesan"),
    Example("oh, undo that", "undo"),
    Example("thanks, you're great", "none"),
    Example("Right, buy the basket.", "buy"),
)
