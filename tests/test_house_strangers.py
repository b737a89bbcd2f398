"""Orders as strangers type them to the robot: in haste, politely, in several parts, corrected."""

from __future__ import annotations

import pytest

from heard import told


@pytest.mark.parametrize(
    ("scene", "said", "changes", "notes"),
    [
        (
            "Kitchen1",
            ["hey robot cld you put the apple into the fridge pls"],
            ["apple: now in the fridge"],
            [],
        ),
        ("Kitchen1", ["stick the lettuce in the sink"], ["lettuce: now in the sink basin"], []),
        (
            "Kitchen1",
            ["Pop the bread in the cupboard for me, would ya?"],
            ["bread: now in cabinet 1"],
            [],
        ),
        ("Kitchen1", ["The dirty mug needs a wash."], ["mug 1: no longer dirty"], []),
        ("Kitchen1", ["I'd like the tomato on a plate please"], ["tomato: now on plate 1"], []),
        (
            "Kitchen1",
            ["Give the mug a quick rinse and leave it in the sink"],
            ["mug 1: no longer dirty, now in the sink basin"],
            [],
        ),
        ("Kitchen1", ["lights off please"], ["light switch: no longer on"], []),
        (
            "Kitchen1",
            ["put the fork, the spoon and the butter knife on the dining table"],
            [
                "butter knife: now on the dining table",
                "fork: now on the dining table",
                "spoon: now on the dining table",
            ],
            [],
        ),
        ("Kitchen1", ["all three eggs in the fridge please"], ["egg 3: now in the fridge"], []),
        (
            "Kitchen1",
            ["put the eggs on the plate, no wait, in the bowl"],
            ["egg 1: now in the bowl", "egg 2: now in the bowl", "egg 3: now in the bowl"],
            [],
        ),
        (
            "Kitchen1",
            ["Chuck the potatoes in the pot and fill the pot with water"],
            ["pot: filled with water", "potato 1: now in the pot", "potato 2: now in the pot"],
            [],
        ),
        ("Kitchen1", ["pour some wine into the cup"], ["cup: filled with wine"], []),
        (
            "Kitchen1",
            ["make me a coffee"],
            ["mug 2: filled with coffee, now on counter 1"],
            [],
        ),
        (
            "Kitchen1",
            ["Set the table: two plates, a fork and a knife"],
            [
                "plate 1: now on the dining table",
                "plate 2: now on the dining table",
                "knife: now on the dining table",
                "fork: now on the dining table",
            ],
            [],
        ),
        (
            "Kitchen1",
            ["throw the egg thats on the counter in the bin"],
            ["egg 3: now in the garbage can"],
            [],
        ),
        ("Kitchen1", ["slice the tomatoe"], ["tomato: sliced"], []),
        (
            "Kitchen1",
            ["Please wash both mugs and stack them in the cabinet"],
            ["mug 1: no longer dirty, now in cabinet 1"],
            [],
        ),
        (
            "Kitchen1",
            ["get the wine from the shelf and put it on the table"],
            ["wine bottle: now on the dining table"],
            [],
        ),
        (
            "Kitchen1",
            ["i want the salt and pepper next to the stove, on the counter"],
            ["salt shaker: now on counter 1", "pepper shaker: now on counter 1"],
            [],
        ),
        ("Kitchen1", ["turn on the tap"], ["faucet: on"], []),
        ("Kitchen1", ["open all the drawers"], ["drawer 2: open", "drawer 1: open"], []),
        ("Kitchen1", ["Fridge open, please."], ["fridge: open"], []),
        ("Kitchen1", ["please put the appel in teh fridge"], ["apple: now in the fridge"], []),
        (
            "Kitchen1",
            ["put the spatula back in the drawer and shut it"],
            [],
            ["The spatula is in drawer 1 already.", "Drawer 2 is closed already."],
        ),
        ("Kitchen1", ["turn on the light"], [], ["The light switch is on already."]),
        ("Kitchen1", ["close the fridge"], [], ["The fridge is closed already."]),
        (
            "Kitchen1",
            ["Would it be possible for you to move the bowl over to the counter?"],
            ["bowl: now on counter 1"],
            [],
        ),
        (
            "Kitchen1",
            ["the sponge goes under the sink in the cabinet"],
            ["sponge: now in cabinet 1"],
            [],
        ),
        (
            "Kitchen1",
            ["bring the apple", "and now put it back"],
            [],
            [],
        ),
        (
            "Kitchen1",
            ["put the apple in the fridge", "oh and the tomato"],
            ["tomato: now in the fridge", "apple: now in the fridge"],
            [],
        ),
        (
            "Kitchen1",
            ["put the apple in the fridge", "actually put it in the bowl instead"],
            ["apple: now in the bowl"],
            [],
        ),
        (
            "Kitchen1",
            ["don't touch the eggs but put all the other food in the fridge"],
            [
                "bread: now in the fridge",
                "tomato: now in the fridge",
                "potato 1: now in the fridge",
                "potato 2: now in the fridge",
                "apple: now in the fridge",
            ],
            [],
        ),
        ("LivingRoom1", ["tv on, lamp off"], ["TV: on", "desk lamp: no longer on"], []),
        (
            "LivingRoom1",
            ["could u please turn off every lamp in here and shut the laptop"],
            ["floor lamp: no longer on", "laptop: no longer open", "desk lamp: no longer on"],
            [],
        ),
        (
            "LivingRoom1",
            ["put both phones on the desk"],
            ["phone 1: now on the desk", "phone 2: now on the desk"],
            [],
        ),
        (
            "LivingRoom1",
            ["pick up the remote and place it beside the tv on the tv stand"],
            ["remote control: now on the TV stand"],
            [],
        ),
        (
            "LivingRoom1",
            ["wash the mug thats on the desk and leave it there"],
            ["mug: no longer dirty"],
            [],
        ),
        ("LivingRoom1", ["Fluff the pillows"], [], ["I did not understand: fluff the pillows."]),
        (
            "LivingRoom1",
            ["put my keys, my watch & my credit card in the box"],
            ["credit card: now in the box", "keys: now in the box", "watch: now in the box"],
            [],
        ),
        (
            "LivingRoom1",
            ["I left my phone on the sofa, bring it to the coffee table"],
            ["phone 1: now on the coffee table"],
            [],
        ),
        (
            "LivingRoom1",
            ["fill up the watering can, then water the plant with it"],
            ["plant: filled with water", "watering can: filled with water"],
            [],
        ),
        (
            "LivingRoom1",
            ["hide the remote in a drawer lol"],
            ["remote control: now in drawer 2"],
            [],
        ),
        (
            "Bedroom1",
            ["Tidy up: pen and pencil into the drawer, mug onto the dresser."],
            ["pen: now in drawer 1", "pencil: now in drawer 1", "mug: now on the dresser"],
            [],
        ),
        (
            "Bedroom1",
            ["can you put the laptop and the phone away in the safe and close the box"],
            ["box: no longer open", "phone: now in the safe", "laptop: now in the safe"],
            [],
        ),
        ("Bedroom1", ["wash the cloth, its dirty"], ["cloth: no longer dirty"], []),
        (
            "Bathroom1",
            ["swap the towels around"],
            [],
            ["I did not understand: swap the towels around."],
        ),
        (
            "Bathroom1",
            ["hang the towel on the towel holder"],
            [],
            ["The towel is on the towel holder already."],
        ),
        ("Bathroom1", ["run the shower"], ["shower head: on"], []),
        (
            "Kitchen1",
            ["would u mind putting the bread in the microwave"],
            ["bread: now in the microwave"],
            [],
        ),
        (
            "Kitchen1",
            ["grab the spoon and drop it in the bowl pls"],
            ["spoon: now in the bowl"],
            [],
        ),
        ("Kitchen1", ["Plants thirsty, water it"], ["plant: filled with water"], []),
        (
            "Kitchen1",
            ["could you empty the wine bottle and put it in the trash?"],
            ["wine bottle: emptied, now in the garbage can"],
            [],
        ),
        ("Kitchen1", ["Turn the stove on"], ["stove burner 1: on", "stove knob 1: on"], []),
        ("Kitchen1", ["microwave closed?"], [], []),
        ("Kitchen1", ["clean up the dirty dishes please"], ["mug 1: no longer dirty"], []),
        (
            "Kitchen1",
            ["hey, put the butter knife... sorry, the fork, on the table"],
            ["fork: now on the dining table"],
            [],
        ),
        (
            "Kitchen1",
            ["The lettuce belongs in the fridge"],
            [],
            ["The lettuce is in the fridge already."],
        ),
        ("Kitchen1", ["bring me a mug and fill it with coffee"], ["mug 2: filled with coffee"], []),
        ("LivingRoom1", ["Can you dim the lights"], [], ["I did not understand: dim the lights."]),
        (
            "LivingRoom1",
            ["desk lamp off, floor lamp off, laptop closed"],
            ["floor lamp: no longer on", "laptop: no longer open", "desk lamp: no longer on"],
            [],
        ),
        (
            "LivingRoom1",
            ["my phone is on the sofa. please put it on the side table"],
            ["phone 1: now on the side table"],
            [],
        ),
        (
            "LivingRoom1",
            ["Move the statue to the side table but be careful with the vase"],
            ["statue: now on the side table"],
            [],
        ),
        (
            "LivingRoom1",
            ["throw the newspaper away, will ya"],
            ["newspaper: now in the garbage can"],
            [],
        ),
        ("Bedroom1", ["The cloth could do with a wash"], ["cloth: no longer dirty"], []),
        (
            "Bathroom1",
            ["put the spray bottle on the shelf and the sponge with it"],
            ["spray bottle: now on the shelf", "sponge: now on the shelf"],
            [],
        ),
    ],
)
def test_what_strangers_type_is_done_or_told(
    scene: str, said: list[str], changes: list[str], notes: list[str]
) -> None:
    assert told(scene, *said)[:2] == (set(changes), notes)


@pytest.mark.parametrize(
    "statement",
    [
        "our mug slid into the sink",
        "the tomato fell onto the floor",
        "my daughter threw the apple into the garbage can",
        "the knife into the toaster is a bad idea",
        "the bread back on the counter smells nice",
        "coffee dripped onto the plate",
        "the plates dirty",
        "oh dear, the cup dirty",
        "dirty dishes",
        "the fridge open and the light on",
        "the microwave open, how odd",
        "my kid left the cabinet open",
    ],
)
def test_what_only_tells_of_the_house_moves_nothing(statement: str) -> None:
    assert told("Kitchen1", statement)[:2] == (set(), [])


@pytest.mark.parametrize(
    ("order", "change"),
    [
        ("the tomato into the sink", "tomato: now in the sink basin"),
        ("the tomato into the sink please", "tomato: now in the sink basin"),
        ("the fridge open please", "fridge: open"),
        ("microwave open", "microwave: open"),
        ("wine into the cup", "cup: filled with wine"),
        ("coffee into the cup", "cup: filled with coffee"),
    ],
)
def test_orders_without_a_verb_are_done(order: str, change: str) -> None:
    assert told("Kitchen1", order)[:2] == ({change}, [])


@pytest.mark.parametrize(
    ("order", "question"),
    [
        ("break the botle", "May I break the wine bottle?"),
        ("slice the tomatto", "May I slice the tomato?"),
        ("please smash the botle", "May I break the wine bottle?"),
    ],
)
def test_a_guessed_word_is_asked_about_before_what_lasts(order: str, question: str) -> None:
    assert told("Kitchen1", order) == (set(), [], question)


SINK = "mug 2: now in the sink basin"
DARK = "light switch: no longer on"


@pytest.mark.parametrize(
    ("said", "changes"),
    [
        (["Put the mug in the sink", "Put it back"], set()),
        (["Put the mug in the sink", "Put it back", "Thanks, open the fridge"], {"fridge: open"}),
        (["Put the mug in the sink", "Now put the mug back where it was, please."], set()),
        (["Put the mug in the sink", "Return the mug"], set()),
        (["Put the mug in the sink", "Can you put it back where you found it?"], set()),
        (["Bring me the mug", "Put it back"], set()),
        (["Put the apple and the tomato in the fridge", "Put them back"], set()),
        (["Put the mug in the sink", "Don't put it back"], {SINK}),
        (["Put the mug in the sink", "Should I put it back?"], {SINK}),
        (["Put the mug in the sink", "I'll put it back myself"], {SINK}),
        (["Put the mug back in the sink"], {SINK}),
        (["Open the fridge and the microwave", "Close everything"], set()),
        (["Open the fridge", "Don't close everything"], {"fridge: open"}),
        (["Kill the lights"], {DARK}),
        (["Turn everything off, please."], {DARK}),
    ],
)
def test_things_go_back_to_where_they_were(said: list[str], changes: set[str]) -> None:
    assert told("Kitchen1", *said)[:2] == (changes, [])
