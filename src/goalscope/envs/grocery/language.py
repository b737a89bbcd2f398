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
    Example("lasagne sheets please", "add lasagne sheets"),
    Example("and parmesan", "add parmesan"),
    Example(
        "half a kilo of minced beef, 2 tins of tomatoes, kitchen roll, bay leaves",
        "add minced beef | 0.5 kilo\nadd tomatoes | 2 tin\nadd kitchen roll\nadd bay leaves",
    ),
    Example("red", "add red onions", "Which onions would you like?"),
    Example("mmh go on then", "yes", "We have fresh basil. Shall I add it?"),
    Example("nah, too dear. the dried one", "no\nadd dried basil", "Shall I add fresh basil?"),
    Example("three of those, my brother eats a lot of it", "set dried basil | 3"),
    Example(
        "my dad can't have nuts, they give him hives",
        "avoid nuts | for my dad | why allergy",
    ),
    Example("no celery for me", "avoid celery | why taste"),
    Example("actually no beef, use soya mince instead", "swap minced beef | for soya mince"),
    Example("I meant the small tins", "swap tomatoes | for small tins of tomatoes"),
    Example("is the soya mince gluten free?", "ask soya mince"),
    Example("a dozen eggs, if they are free range", "add eggs | 1 dozen | if they are free range"),
    Example("maybe we could get wine, let me think", "none"),
    Example("it all has to be under 60 dollars", "budget | 60 dollar"),
    Example("only organic stuff please, I don't like the other", "only organic | why taste"),
    Example("leave the eggs, take out the parmesan", "leave eggs\nremove parmesan"),
    Example("oh, undo that", "undo"),
    Example("what's it all come to?", "ask"),
    Example("thanks, you're great", "none"),
    Example("Right, buy the basket.", "buy"),
)
