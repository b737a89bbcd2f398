"""Words that speak of a purchase, or of breaking something, and are no order for it."""

from __future__ import annotations

from collections.abc import Callable

from fakes import WordModel
from goalscope.agent import Agent
from goalscope.envs.grocery import Catalogue, GroceryShop
from goalscope.envs.grocery.search import Search
from goalscope.policy import Planner
from goalscope.types import Turn

ITEMS = [each for each in Catalogue.load().items if each.id % 40 == 0 or each.name == "Whole Milk"]
CATALOGUE = Catalogue(ITEMS)
SHOP = GroceryShop(CATALOGUE)
SEARCH = Search(CATALOGUE)

QUERIES = (
    "What can I help you with?",
    "What else would you like?",
    "Shall I buy the basket?",
    "That cannot be undone. Do you confirm exactly what is shown?",
    "Would you like some milk?",
)

NEGATED = """
don't buy the basket yet
do not check out
please don't place the order
never buy the basket without asking me
no, don't buy it
I don't want to check out
I do not want to buy the basket now
we're not ready to check out
I'm not going to buy this
You mustn't buy the basket
you must never check out on your own
nobody told you to buy the basket
I didn't say buy the basket
I never said to check out
don't you dare buy the basket
not buying the basket today
no purchase please
no order yet
hold on, don't check out
wait, don't buy it
stop, do not buy anything
let's not buy the basket
let's not check out yet
I'd rather not check out
I would rather not buy the basket
I can't buy the basket right now
we cannot pay for this
I won't pay for that
please cancel, I don't want to buy it
buy the basket? Absolutely not
Buy the basket? No way.
Under no circumstances buy the basket
I refuse to buy the basket
it is not time to check out
it isn't time to buy the basket
there's no need to check out
there is no reason to place the order
ok, but don't buy the basket
yes, but do not check out
Great, just don't buy the basket
Looks good, but no purchase yet
neither buy the basket nor empty it
I'm done, but don't check out
that's all, don't place the order
without buying the basket, tell me the total
"""

QUOTED = """
my sister said 'buy it'
my sister said "buy the basket"
He said: buy the basket
she told me, buy the basket
The button says "Buy the basket"
It says check out on the screen
the phrase is "buy the basket"
"buy the basket" is what I say at the end
'buy the basket'?
what does "check out" mean?
you wrote "buy the basket"
my note reads: buy the basket
My son just shouted buy the basket
the radio said check out
the recipe says: buy everything
the page tells me to say Buy the basket
Did I say "buy the basket"?
I read "place the order" somewhere
the word checkout confuses me
the manual says place the order
Someone in the room said buy it all
ignore my kid, who said buy the basket
type "buy the basket" to finish, right?
so I say "buy the basket" and then?
the assistant before you said "check out now"
my husband yelled check out
she wrote: please buy the basket
they always say buy the basket
I was told to say buy the basket
«buy the basket» is in quotes
`buy the basket`
\u201cbuy the basket\u201d, she said
"please check out", said nobody ever
the mail said "complete the purchase"
my friend would say buy the basket
"""

HYPOTHETICAL = """
if it were cheaper I'd buy it
I would buy the basket if it were cheaper
suppose I buy the basket
what if I buy the basket?
what happens if I check out
imagine we buy the basket
let's say I buy the basket, what then
would it be wise to buy the basket?
should I buy the basket?
could I buy the basket tomorrow?
can I still change it after I check out?
do I have to check out?
is it safe to place the order?
shall we buy the basket?
maybe buy the basket
perhaps we check out
possibly buy the basket
I might buy the basket
I may check out later
I could buy the basket, or not
I wonder whether to buy the basket
I'm thinking of buying the basket
I'm considering checking out
thinking about whether to place the order
in theory I buy the basket
pretend I said buy the basket
assume that I buy the basket
were I to buy the basket, what would it cost?
had I bought the basket, would you tell me?
how do I buy the basket?
how much is it to buy the basket?
why would I buy the basket
when can I check out?
where do I pay for it?
who can place the order?
is it possible to buy the basket in cash?
do you think I should check out?
would you buy the basket?
it would be nice to buy the basket
it might be time to check out
I'd love to be able to buy the basket
one could buy the basket
what would you do, buy the basket?
am I ready to check out?
buy the basket, or wait?
buy the basket or add milk, I can't decide
to buy the basket or not to buy the basket
hmm, buy the basket?
check out?
place the order?
"""

CONDITIONAL = """
if the eggs are in, buy the basket
buy the basket if it is under 50 dollars
if that's all, check out
once the milk is in, buy the basket
buy the basket once you have added milk
when I say so, buy the basket
buy the basket when I say so
unless it costs more than 20, buy it
buy the basket unless it is too expensive
after you add butter, check out
check out after adding butter
before you buy the basket, add milk
buy the basket only if there is rye bread
as soon as I am paid, buy the basket
buy it as long as it is vegan
provided it is gluten-free, buy the basket
buy the basket provided that it's fresh
in case I forget, buy the basket
until I buy the basket, keep looking
first add eggs, then buy the basket
add milk and buy the basket
buy the basket, but first remove the eggs
buy the basket and then add milk
buy the basket without the eggs
buy the basket except the bread
buy the basket with two more eggs
buy the basket for less than 10 dollars
tomorrow, buy the basket
buy the basket tomorrow
buy the basket next week
buy the basket at noon
buy the basket later
later check out
buy the basket in an hour
check out on Friday
not before Monday, then check out
wait for my wife and then check out
ask me again and then buy the basket
remind me to buy the basket
let me know when to buy the basket
buy the basket when the price drops
if you can't find tofu, check out
buy the basket assuming it has bread
buy the basket, no wait
buy the basket... just kidding
buy the basket, not
"""

PAST = """
I bought the basket
we already bought the basket
I checked out yesterday
you bought the basket, didn't you?
did you buy the basket?
did I check out already?
was the basket bought?
has the order been placed?
the basket was bought
the order has been placed
I had bought the basket by then
last week I said buy the basket
last time you bought the basket too early
why did you buy the basket?
I wanted to buy the basket
I wanted to check out but it failed
I was going to buy the basket
I was about to check out
I used to buy the basket here
we tried to buy the basket
I almost bought it
have you placed the order?
who bought the basket?
when was the order placed?
I thought you bought the basket
I meant to check out
I have been trying to buy the basket
you were told to buy the basket
I asked you to buy the basket hours ago
you forgot to buy the basket
"""

THIRD = """
my wife will buy the basket
my husband wants to check out
my mother buys the basket herself
my friend should buy the basket
the neighbours buy the basket every week
she will place the order
he buys it
they want you to buy the basket
let my son buy the basket
have my wife check out
ask my husband to buy the basket
tell her to buy the basket
everyone buys the basket here
somebody else will pay for the order
my boss pays for the order
people buy the basket when they are done
the other shopper can check out
my daughter is ready to check out
is my husband ready to check out?
my kids would buy everything
grandma says she buys the lot
who else wants to buy the basket
we all want mum to buy the basket
some people just buy the basket
my assistant will complete the purchase
"""

OTHER = """
check out the organic milk
can you check out what bread there is
I want to buy a basket
buy me a gift basket
buy a basket of strawberries
order more eggs
I'd like to order pizza
I want to buy eggs
buy eggs
I don't buy that
pay attention to the order
in order to bake, I need flour
the order of the items is wrong
sort the basket
show me the basket
what's in the basket?
is the basket ready to buy?
how does the checkout work?
yes
ok
sure
go ahead
that's all
thanks, that's it
I'm done
nothing else
confirm
do it
perfect
yes please
"""

NO_ORDERS = [
    line
    for text in (NEGATED, QUOTED, HYPOTHETICAL, CONDITIONAL, PAST, THIRD, OTHER)
    for line in text.strip().splitlines()
]

ORDERS = """
Buy the basket
buy the basket.
Buy the basket!
please buy the basket
Please buy the basket now.
ok, buy the basket
Okay, please buy the basket
yes, buy the basket
Yes please, buy the basket
Great, buy the basket
Perfect, buy the basket now
That's all, buy the basket
That's everything, buy the basket.
Nothing else. Buy the basket.
I'm done, buy the basket
I'm ready, buy the basket
Looks good, buy the basket
Looks good to me. Buy the basket, please.
Thanks, buy the basket
Thank you. Now buy the basket.
buy the whole basket
buy my basket
buy this basket
buy the cart
buy my cart please
buy my groceries
buy everything
buy it all
Buy everything in the basket
Purchase the basket
please purchase the basket
purchase everything
Order everything, please
order it all
Check out
check out now
checkout please
Please check out.
Let's check out
let's buy the basket
I'd like to check out
I would like to check out now, please
I'd like to buy the basket
I want to buy the basket
I want you to buy the basket
I'm ready to check out
We're ready to check out
I am ready to buy the basket
Can you buy the basket, please?
Could you buy the basket now?
Could you please check out?
Would you buy the basket, please?
Can we check out now?
You can buy the basket now
You may buy the basket
Go ahead and buy the basket
feel free to check out
Place the order
Please place my order
Complete the purchase
Finish my order, please
Submit the order
confirm my order
Proceed to checkout
Pay for the basket
It's time to check out
""".strip().splitlines()


def bought_on(words: str) -> bool:
    """Whether the agent buys what is in a basket, on these words alone."""
    shop = GroceryShop(CATALOGUE, search=SEARCH)
    model = WordModel()
    few = Planner(model, draws=0, kinds=0, near=1)
    agent = Agent(shop, model, method="no-goals", planner=few)
    added = agent.step("What?", "Add whole milk, please.")
    assert added.results
    agent.step("What else?", words)
    return shop.bought


def test_sentences_that_speak_of_buying_and_order_nothing_buy_nothing(
    record_property: Callable[[str, object], None],
) -> None:
    assert len(set(NO_ORDERS)) >= 200
    taken = [
        (query, words)
        for words in NO_ORDERS
        for query in QUERIES
        if SHOP.is_completion(Turn(query, words))
    ]
    bought = [words for words in NO_ORDERS if bought_on(words)]
    assert (taken, bought) == ([], [])
    record_property(
        "measured", f"{len(set(NO_ORDERS))} sentences that are no order: {len(bought)} purchases"
    )


def test_an_order_to_buy_buys(record_property: Callable[[str, object], None]) -> None:
    missed = [words for words in ORDERS if not bought_on(words)]
    assert missed == []
    assert len(set(ORDERS)) >= 60
    record_property(
        "measured", f"{len(set(ORDERS))} orders to buy: {len(ORDERS) - len(missed)} purchases"
    )
