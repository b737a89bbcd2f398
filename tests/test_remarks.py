"""What says nothing of what is wanted, and what may."""

import pytest

from goalscope.envs.remarks import asks_why, changes_mind, is_remark, takes_leave

REMARKS = """
Why did you add that?
Why butter?
why did u put butter in the basket
How come there is cheese in my basket?
I didn't ask for that.
I did not ask for that!
I never said I wanted beef
Who asked you to open the fridge?
What are you doing?
What is this for?
What did you add?
That's wrong.
That's not what I asked for.
This is too much.
that's too expensive
You are not listening.
You misunderstood me.
No.
No, thanks.
Nope
Thanks, that's all.
Thank you so much!
Thanks a lot, great job
Great!
Perfect, thank you.
hello
Hi there!
Good morning
How are you?
What can you do?
Who are you?
never mind
Stop!
Huh?
Are you sure?
Did I ask for that?
Have you added the butter for me?
Is that right?
I don't know.
Nothing else, thanks
That's it
That's everything.
I'm happy with that
ok thanks
Wait, why did you do that?
But I didn't want that!
No, that's wrong
this makes no sense
you got it wrong
Was that necessary?
what the hell
I don't understand
Not really
that's all for now
that's all for tonight, thank you
that's it for this evening
that's everything for the day
Nobody asked for cheese.
Why are you moving the mug?
What did you do with the apple?
that is nice
I see
It's fine, thanks
That's not right. Why did you add milk?
Stop adding things!
That is way over 20 dollars!
Good morning, how are you today?
What did you just add?
Goodbye
I never asked you to add it

""".strip().splitlines()

WISHES = """
Yes
Yes please
ok
sure
Why not add some cookies?
Why don't you add some butter?
Something sweet?
Maybe something for breakfast?
No, oil
No nuts please
Nothing with nuts
I want chicken
I didn't ask for beef, I want chicken
I need eggs
Are you able to get me bananas?
Is it possible to get bread?
What do you suggest for dessert?
What goes well with pasta?
Could you add milk?
Can I have milk?
I'm cooking for six
It's for my birthday
That's too much sugar for my mother
You forgot the milk
Make me a coffee
bring me the mug
I'm hungry
I am cold
It's dark in here
I'd like to bake something
good bread
nice cheese
great big tomatoes
I'm vegan
I'm allergic to nuts
We are having a party
That's good for a salad
What about some fruit?
How about fish?
How do you make pancakes?
A lot of cheese
Two
the second one
Good olive oil, please
I like it spicy
I love that cheese
I don't mind meat
I don't care for fish
Thanks, and some milk
I'm done with work and I am hungry
It is my sister's birthday
not too sweet
this is for a picnic
Do you know a good recipe?
Is it okay to add cake?
I don't know, something light
fine salt
perfect, now add eggs
I am ready for dinner
Well, pasta
I'm lost without coffee
it's a joke gift
I haven't got any eggs
I have not eaten yet
We didn't have breakfast
Stop at the bakery for bread
No more sugar
What the kids love is pizza.
Have you any ideas for a vegan dinner?
We haven't ordered the birthday cake yet
We never want meat again
I did not mention that I am vegan
What can you do with chicken?
It's over there
That is more than enough for a cake with cherries

""".strip().splitlines()


@pytest.mark.parametrize("text", REMARKS)
def test_a_remark_says_nothing_of_what_is_wanted(text: str) -> None:
    assert is_remark(text)


@pytest.mark.parametrize("text", WISHES)
def test_what_may_be_a_wish_is_no_remark(text: str) -> None:
    assert not is_remark(text)


def test_who_asks_why_asks_for_a_reason() -> None:
    assert asks_why("Thanks. But why did you add butter?")
    assert asks_why("How come there is butter?")
    assert not asks_why("Why don't you add butter?")
    assert not asks_why("That is why I need butter.")


@pytest.mark.parametrize(
    ("text", "leaves"),
    [
        ("That's all, thanks", True),
        ("Thanks, we're done here", True),
        ("Nothing else", True),
        ("Good night", True),
        ("Bye bye!", True),
        ("It's all good", False),
        ("I'm done with pasta", False),
        ("Nothing with nuts", False),
        ("Is that all?", False),
    ],
)
def test_who_is_done_takes_leave(text: str, *, leaves: bool) -> None:
    assert takes_leave(text) is leaves


@pytest.mark.parametrize(
    ("text", "changes"),
    [
        ("Sorry, I changed my mind. Not lasagna, let's make a curry instead.", True),
        ("Not lasagna, a vegetable curry instead", True),
        ("On second thought, we'd rather grill.", True),
        ("Forget the cake, let's have ice cream", True),
        ("Let's make soup instead!", True),
        ("Almond milk instead of milk", False),
        ("I never change my shirt. Instead I wash it.", False),
        ("Let's use oil instead of butter", False),
        ("My mind is made up", False),
    ],
)
def test_who_changes_their_mind_says_so(text: str, *, changes: bool) -> None:
    assert changes_mind(text) is changes
