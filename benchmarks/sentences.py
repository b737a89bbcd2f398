"""How likely single sentences make a goal: those that docs/limits.md and docs/tracking.md name.

python benchmarks/sentences.py
"""

from __future__ import annotations

from goalscope import UNSPECIFIED, Goal, GoalTracker, open_model
from goalscope.belief.advice import SURE, advice
from goalscope.models.opening import ModelSet

BANK = [
    "transfer money to Anna",
    "block the credit card",
    "delete the account",
    "see the balance",
    "change the plan",
]
HOME = {
    "lock the front door": "unlock the front door",
    "turn on the heating": "turn off the heating",
    "close the curtains": "open the curtains",
    "turn up the music": "turn down the music",
    "switch on the lamp": "switch off the lamp",
    "open the garage": "close the garage",
}
HELP = "How can I help you?"
LOST = "I want to block my credit card, I lost it."
SAID = [
    [(HELP, "Please transfer money to Anna.")],
    [(HELP, "Do not transfer money to Anna.")],
    [(HELP, "I never asked you to block the credit card!")],
    [(HELP, "What happens if I block the credit card?")],
    [(HELP, "Whatever you do, don't delete my account!")],
    [(HELP, "Please block my credit card."), ("Sure?", "Yes!")],
    [(HELP, LOST)],
    [(f"Do you want to {', '.join(BANK[:-1])}, or {BANK[-1]}?", LOST)],
    [("Do you want to block a lost card?", "Yes, block the card.")],
]
AIRLINE = [
    "change the date of a flight",
    "choose a seat",
    "get a refund",
    "order a vegetarian meal",
    "bring a dog on board",
]
LUGGAGE = ("get their lost suitcase back", "find lost luggage")
BAGS = ("My suitcase didn't come out on the belt in Lisbon.", "My bag never arrived.")


def after(model: ModelSet, task: str, goals: list[str], *turns: tuple[str, str]) -> GoalTracker:
    """A tracker of the goals that has heard the turns."""
    tracker = GoalTracker(model, task=task, goals=goals)
    for query, utterance in turns:
        tracker.observe(query, utterance)
    return tracker


def main() -> None:
    """Print the likeliest hypothesis for the bank's customers, then the airline's and the home."""
    model = open_model()
    for turns in SAID:
        tracker = after(model, "Help the customer of a bank.", BANK, *turns)
        (goal, probability), *_ = tracker.belief.top(1)
        words = " / ".join(" ".join(turn) for turn in turns)
        print(f"{probability:4.0%}  {goal.text:24}{advice(tracker):9}{words}")

    for wish in LUGGAGE:
        for utterance in BAGS:
            goals = [wish, *AIRLINE]
            tracker = after(model, "Help an airline's customer.", goals, (HELP, utterance))
            probability = dict(tracker.belief.top())[Goal(wish)]
            print(f"{probability:4.0%}  {wish:33}{utterance}")

    for listed in ([*HOME], [*HOME, *HOME.values()]):
        for kind, wishes in (("the goals", HOME), ("their opposites", HOME.values())):
            right: list[float] = []
            wrong: list[float] = []
            for wish in wishes:
                said = (HELP, f"{wish.capitalize()}.")
                tracker = after(model, "Help at home.", listed, said)
                tops = (top for top in tracker.belief.top() if top[0] != UNSPECIFIED)
                goal, probability = next(tops)
                (right if goal.text == wish else wrong).append(probability)
            sure, misled = (sum(p >= SURE for p in each) for each in (right, wrong))
            print(
                f"{len(listed)} goals listed, {kind} asked for: right first {len(right)} "
                f"(sure of {sure}), wrong first {len(wrong)} (sure of {misled})"
            )


if __name__ == "__main__":
    main()
