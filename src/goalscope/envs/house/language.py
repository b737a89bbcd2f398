"""What people order of the robot: its verbs, and readings that show them."""

from goalscope.orders import Example, Verb

__all__ = ["EXAMPLES", "VERBS"]

_THING = ("what", "quantity", "where")

VERBS = (
    Verb("put", "bring or move a thing to a place", ("what", "quantity", "for", "where")),
    Verb("pick up", "take a thing in the hand", _THING),
    Verb("open", "open it", _THING),
    Verb("close", "close it", _THING),
    Verb("turn on", "switch it on", _THING),
    Verb("turn off", "switch it off", _THING),
    Verb("fill", "fill it, with water unless said", ("what", "quantity", "for", "where")),
    Verb("empty", "pour it out", _THING),
    Verb("slice", "cut it", _THING, irreversible=True),
    Verb("cook", "boil, fry, toast or warm it, in the place said", _THING, irreversible=True),
    Verb("clean", "wash or wipe it", _THING),
    Verb("make", "prepare a drink or dish", ("what", "quantity", "for", "where")),
    Verb("break", "break it", _THING, irreversible=True),
    Verb("push", "push it", _THING),
    Verb("pull", "pull it", _THING),
    Verb("finish", "the task is done", ()),
)

EXAMPLES = (
    Example("Morning. I'm having friends over tonight.", "aim"),
    Example("open the blinds would you, it's so dark in here", "open blinds"),
    Example(
        "grab the dirty mug off the desk, wash it and put it by the coffee machine",
        "clean dirty mug | where desk\nput mug | where coffee machine",
    ),
    Example("and a coffee in it", "make coffee | where mug"),
    Example("if the window's open close it", "close window | if the window's open"),
    Example("not that lamp, the one on the shelf", "turn on lamp | where shelf"),
    Example(
        "bring me two forks and the red bowl", "put forks | 2 | where me\nput red bowl | where me"
    ),
    Example("the bowl's for soup, mind, so rinse it first", "clean red bowl"),
    Example("is there any bread in the fridge?", "ask bread | where fridge"),
    Example("don't touch the vase", "leave vase"),
    Example("sure", "yes", "Shall I slice the bread?"),
    Example("no, I'll do it. the tap's still running", "no\nturn off tap", "Shall I slice it?"),
    Example("slice the tomato and fry an egg in the pan", "slice tomato\ncook egg | where pan"),
    Example("the potato is in the sink", "none"),
    Example("don't close it yet", "none"),
    Example("wrong, put it back", "undo"),
    Example("undo the last two", "undo | 2"),
    Example("what was that noise?", "ask"),
    Example("haha you're quick", "none"),
    Example("thanks, that's all", "finish"),
)
