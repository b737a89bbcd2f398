"""What a finished fit leaves: the adapter in two formats, its figures, and its model card."""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import StrictUndefined
from jinja2.sandbox import SandboxedEnvironment

from goalscope.fitting.fit import Fit, Validation
from goalscope.types import GoalscopeError

__all__ = ["curve", "write_card"]

_OBJECTIVES = {
    "words": "The loss is minus the log-probability of the person's words under their goal and "
    "under none, nats a token.",
    "goals": "The loss is minus the log-posterior of the true goal, with Unspecified among the "
    "wrong ones, and of Unspecified where the true goal is left out.",
    "both": "The loss is minus the log-posterior of the true goal, with Unspecified among the "
    "wrong ones, and of Unspecified where the true goal is left out; and, with a weight, minus "
    "the log-probability of the person's words.",
}


def write_card(folder: Path, fit: Fit, about: Mapping[str, Any]) -> None:
    """Write `fit.json` and `README.md`, and `curve.svg` where Matplotlib is installed.

    Args:
        folder: Of the adapter.
        fit: The finished fit.
        about: base, sources (name, train, learned, validation, licence, sha256), start, layout,
            device, memory, validated, command.
    """
    facts = {
        **about,
        "version": importlib.metadata.version("goalscope"),
        "settings": asdict(fit.settings),
        "step": fit.step,
        "seconds": fit.history[-1].seconds,
        "best": asdict(fit.best),
        "history": [asdict(each) for each in fit.history],
    }
    (folder / "fit.json").write_text(json.dumps(facts, indent=1) + "\n", encoding="utf-8")
    jinja = SandboxedEnvironment(undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    source = files("goalscope.fitting").joinpath("card.md").read_text(encoding="utf-8")
    objective = _OBJECTIVES[fit.settings.objective]
    text = jinja.from_string(source).render(facts, name=folder.name, objective=objective)
    (folder / "README.md").write_text(text + "\n", encoding="utf-8")
    try:
        drawn = curve(fit.history)
    except GoalscopeError:  # no Matplotlib: the card has the figures
        return
    (folder / "curve.svg").write_text(drawn, encoding="utf-8")


def curve(history: Sequence[Validation]) -> str:
    """An SVG of log-loss and AUROC on the dialogues that validate, by step.

    Raises:
        GoalscopeError: Matplotlib is missing.
    """
    from goalscope.report.drawing import COLOURS, draw

    def paint(figure: Any) -> None:
        steps = [each.step for each in history]
        left, right = figure.subplots(1, 2)
        left.plot(steps, [each.log_loss for each in history], marker="o", color=COLOURS[0])
        left.set(title="log-loss (nats)", xlabel="step", ylim=(0, None))
        right.plot(steps, [each.top1 for each in history], marker="o", color=COLOURS[2])
        right.plot(steps, [each.auroc for each in history], marker="s", color=COLOURS[3])
        right.set(title="top-1 and open-set AUROC", xlabel="step", ylim=(0, 1.02))
        right.legend(["top-1", "AUROC"])

    return draw("curve", "Validation by step", (7.0, 2.6), paint)
