"""Does the leading goal stay while the words fit it? An agent hears corpus/beliefs.

python benchmarks/beliefs.py [--out FILE]

A turn is a fit where both readers hold after it what they held before. `--out` keeps the leading
goal after each turn, for somebody to judge.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

from goalscope import UNSPECIFIED, open_model
from goalscope.agent import Agent
from goalscope.domains import Settings, open_environment

ROWS = Path(__file__).parents[1] / "corpus" / "beliefs" / "dev.jsonl"
ROOMS = {"LivingRoom1": ("sofa", "match", "film", "living"), "Bedroom1": ("bed", "pillow", "sleep")}
FALL = 0.1


def room(said: str) -> str:
    """A scene for what is said in it."""
    return next(
        (name for name, signs in ROOMS.items() if any(s in said for s in signs)), "Kitchen1"
    )


def main() -> None:
    """Print how often the leader falls at a fit, and how often nothing leads."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    out = parser.parse_args().out
    model = open_model()
    turns = fits = falls = unknown = 0
    kept: list[dict[str, object]] = []
    for line in ROWS.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
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
            kept.append(
                {"id": row["id"], "turn": number, "said": said, "leader": leader.text}
                | {"probability": round(before, 4), "fit": fit, "fell": fell}
            )
            if leader == UNSPECIFIED:
                leader = None
    if out:
        out.write_text("".join(json.dumps(each) + "\n" for each in kept), encoding="utf-8")
    print(f"turns {turns}, of which no goal leads in {unknown}")
    print(f"fits {fits}, at which the leader falls by more than {100 * FALL:.0f} points: {falls}")


if __name__ == "__main__":
    main()
