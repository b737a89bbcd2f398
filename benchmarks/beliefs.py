"""Is the leading goal one that a person would name, and does it stay while the words fit it?

python benchmarks/beliefs.py [--adapter ADAPTER] [--out FILE]

An agent hears the conversations of corpus/beliefs. A leader is right where both judges found it so
after that turn; of goals that they have not seen, the share is told. A turn is a fit where both
readers hold after it what they held before.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from goalscope import UNSPECIFIED, open_model
from goalscope.agent.agent import Agent
from goalscope.agent.settings import Settings
from goalscope.envs.registry import open_environment

FOLDER = Path(__file__).parents[1] / "corpus" / "beliefs"
ROOMS = {"LivingRoom1": ("sofa", "match", "film", "living"), "Bedroom1": ("bed", "pillow", "sleep")}
FALL = 0.1


def rows(name: str) -> list[dict[str, Any]]:
    """The lines of a file of the corpus."""
    lines = (FOLDER / name).read_text(encoding="utf-8").splitlines()
    return [json.loads(line) for line in lines]


def room(said: str) -> str:
    """A scene for what is said in it."""
    return next(
        (name for name, signs in ROOMS.items() if any(s in said for s in signs)), "Kitchen1"
    )


def main() -> None:
    """Print how often the leader is right, falls at a fit, and is missing."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--adapter")
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    model = open_model(adapter=asked.adapter)
    judged = {(each["id"], each["goal"]): each["right"] for each in rows("judged.jsonl")}
    turns = fits = falls = unknown = right = unseen = 0
    kept: list[dict[str, object]] = []
    for row in rows("dev.jsonl"):
        house = row["domain"] == "house"
        scene = room(" ".join(row["said"]).lower()) if house else None
        env = open_environment(Settings(domain=row["domain"], scene=scene))
        agent = Agent(env, model)
        leader, before, held = None, 0.0, None
        for number, (said, goals) in enumerate(zip(row["said"], row["goals"], strict=True), 1):
            if agent.rounds and agent.rounds[-1].terminated:
                break
            belief = agent.step(agent.ask(), said).belief
            assert belief is not None
            after = dict(belief.top())
            turns += 1
            fit = goals == held and leader is not None
            fell = fit and before - after.get(leader, 0.0) > FALL
            fits, falls = fits + fit, falls + fell
            leader, before = belief.top(1)[0]
            held = goals
            unknown += leader == UNSPECIFIED
            best = next((goal for goal, _ in belief.top() if goal != UNSPECIFIED), None)
            judges = judged.get((row["id"], best.text)) if best else []
            unseen += judges is None
            good = bool(judges) and all(number in each for each in judges)
            right += good
            kept.append(
                {"id": row["id"], "turn": number, "said": said, "leader": leader.text}
                | {"probability": round(before, 4), "fit": fit, "fell": fell, "right": good}
            )
            if leader == UNSPECIFIED:
                leader = None
    if asked.out:
        asked.out.write_text("".join(json.dumps(each) + "\n" for each in kept), encoding="utf-8")
    print(f"turns {turns}, of which no goal leads in {unknown}")
    print(
        f"the likeliest goal is right at {right} ({right / turns:.1%}), and not judged at {unseen}"
    )
    print(f"fits {fits}, at which the leader falls by more than {100 * FALL:.0f} points: {falls}")


if __name__ == "__main__":
    main()
