"""Draw docs/belief.svg: the belief of README's example after each of its turns.

python docs/belief_picture.py
"""

from html import escape
from pathlib import Path

from goalscope import GoalTracker

COLOURS = {
    "bake a chocolate cake": "#8c564b",
    "bake a gluten-free cake": "#2a7f62",
    "cook an Italian dinner": "#c0504d",
    "buy snacks for a party": "#d99a2b",
    "Unspecified": "#888888",
}
TURNS = (
    ("What can I help you with?", "I'd like to bake something for Sunday."),
    ("What did you have in mind?", "A cake, with lots of cocoa in it."),
    ("Is there anything that you cannot use?", "My sister can't eat gluten."),
)


def panel(top: int, query: str, utterance: str, shares: dict[str, float]) -> str:
    """One turn, and beside it a bar for each goal."""
    parts = [
        f'<text x="24" y="{top}" fill="#777">{escape(query)}</text>'
        f'<text x="24" y="{top + 18}" fill="#111" font-weight="600">“{escape(utterance)}”</text>'
    ]
    for row, (goal, colour) in enumerate(COLOURS.items()):
        y, width = top + 3 + 21 * row, max(1.3, 110 * shares[goal])
        parts.append(
            f'<text x="596" y="{y}" text-anchor="end" fill="#333">{escape(goal)}</text>'
            f'<rect x="606" y="{y - 11}" width="{width:.1f}" height="14" rx="2" fill="{colour}"/>'
            f'<text x="{612 + width:.1f}" y="{y}" fill="#333">{shares[goal]:.0%}</text>'
        )
    return "\n".join(parts)


def main() -> None:
    """Have the conversation, and draw what is believed after each turn."""
    tracker = GoalTracker(goals=[goal for goal in COLOURS if goal != "Unspecified"])
    panels: list[str] = []
    for number, (query, utterance) in enumerate(TURNS):
        belief = tracker.observe(query, utterance)
        shares = {goal.text: probability for goal, probability in belief.top()}
        panels.append(panel(28 + 128 * number, query, utterance, shares))
    Path(__file__).with_name("belief.svg").write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 404" '
        'font-family="system-ui,sans-serif" font-size="13">\n'
        '<rect width="760" height="404" rx="10" fill="#fbfaf7"/>\n'
        + "\n".join(panels)
        + "\n</svg>\n",
        encoding="utf-8",
    )


if __name__ == "__main__":
    main()
