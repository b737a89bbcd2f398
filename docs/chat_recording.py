"""Draw docs/chat.svg: a real run of `goalscope chat examples/garden.py`, as a terminal that moves.

python docs/chat_recording.py

The command is run with the words below, and what it prints is told in scenes: a question, words as
they are typed, the belief, what was done. What is waited for is left out. CSS moves the picture, no
script does, and people who want no motion see the end of it.
"""

import os
import subprocess
import sys
from html import escape
from itertools import groupby
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.ansi import AnsiDecoder
from rich.console import Console
from rich.style import Style
from rich.terminal_theme import SVG_EXPORT_THEME as THEME
from rich.text import Text

COMMAND = ("chat", "examples/garden.py")
WORDS = (
    "We want to grow as much of our own food as we can.",
    "I don't want the old walnut tree any more, it takes all the sun.",
    "Yes.",
    "The garden is done.",
)
COLUMNS, ROWS = 80, 30
WIDE, HIGH, EDGE, TOP = 9, 20, 18, 46
"""Of a character, and of what is around all of them, in pixels."""

SCENES = (
    ("Agent", 0.9), ("You", 1.1), ("Round", 1.2), ("Belief", 0.1), ("Goals", 1.6),
    ("Actions", 1.6), ("╭", 1.2), ("! ", 0.8),
)  # fmt: skip
"""How a scene begins, and the seconds before it."""

TYPED = 0.03
"""Seconds a character."""
LAST = 6.0
"""Seconds before it begins again."""
MAIN = "from goalscope.cli.main import main; main()"


def recorded() -> list[Text]:
    """The lines that the command prints, in colour, from its first question on."""
    with TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-c", MAIN, *COMMAND, "--store", f"{folder}/episodes.db"],
            cwd=Path(__file__).parents[1],
            input="\n".join(WORDS) + "\n",
            env={**os.environ, "COLUMNS": str(COLUMNS), "FORCE_COLOR": "1"},
            stdout=subprocess.PIPE,
            encoding="utf-8",
            check=True,
        )
    lines = list(AnsiDecoder().decode(done.stdout))
    first = next(n for n, line in enumerate(lines) if line.plain.startswith("Agent"))
    return [line for line in lines[first:] if not line.plain.startswith("Episode ")]


def scenes(lines: list[Text]) -> list[tuple[float, float, list[Text]]]:
    """Lines that appear together: when, how long they take to be typed, and the lines."""
    number = 0

    def scene(line: Text) -> int:
        nonlocal number
        number += any(line.plain.startswith(begins) for begins, _ in SCENES)
        return number

    found: list[tuple[float, float, list[Text]]] = []
    now = 0.0
    for _, group in groupby(lines, scene):
        shown = list(group)
        head = shown[0].plain
        now += next((pause for begins, pause in SCENES if head.startswith(begins)), 0.0)
        typing = TYPED * sum(len(each.plain) - 7 for each in shown) if head[:3] == "You" else 0.0
        found.append((now, typing, shown))
        now += typing
    return found


def css(style: Style) -> str:
    """A text's style as CSS."""
    ink = style.color.get_truecolor(THEME) if style.color else THEME.foreground_color
    if style.dim:
        ink = [(5 * a + 4 * b) // 9 for a, b in zip(ink, THEME.background_color, strict=True)]
    bold = ";font-weight:700" if style.bold else ""
    italic = ";font-style:italic" if style.italic else ""
    return f"fill:rgb({','.join(map(str, ink))}){bold}{italic}"


def drawn(line: Text, row: int, classes: dict[str, str]) -> str:
    """A line of the terminal as SVG."""
    parts: list[str] = []
    column = 0
    for piece in line.render(Console(width=COLUMNS)):
        text = piece.text.rstrip("\n")
        if text.strip():
            look = classes.setdefault(css(piece.style or Style()), f"c{len(classes)}")
            parts.append(
                f'<text class="{look}" x="{column * WIDE}" y="{row * HIGH + 15}" '
                f'textLength="{len(text) * WIDE}">{escape(text).replace(" ", "&#160;")}</text>'
            )
        column += len(text)
    return "".join(parts)


def picture(lines: list[Text]) -> str:
    """The whole picture as SVG."""
    told = scenes(lines)
    whole = told[-1][0] + LAST
    classes: dict[str, str] = {}
    groups: list[str] = []
    rules: list[str] = []
    rolls = ["0%{transform:none}"]
    row = gone = 0
    for number, (start, typing, shown) in enumerate(told):
        text = "".join(drawn(line, row + n, classes) for n, line in enumerate(shown))
        groups.append(f'<g class="s s{number}">{text}</g>')
        row += len(shown)
        at, end = 100 * start / whole, 100 * (start + typing) / whole
        hidden, clear = "clip-path:inset(0 100% 0 0)", "clip-path:inset(0 0 0 0)"
        steps = f"animation-timing-function:steps({max(1, round(typing / TYPED))})"
        rules.append(
            f"@keyframes k{number}{{0%,{at:.2f}%{{{hidden};{steps}}}"
            f"{max(end, at + 0.01):.2f}%,to{{{clear}}}}}.s{number}{{animation-name:k{number}}}"
        )
        if row - ROWS > gone:
            rolls.append(f"{at:.2f}%{{transform:translateY({-gone * HIGH}px)}}")
            gone = row - ROWS
            after = f"{at + 30 / whole:.2f}%"
            rolls.append(f"{after}{{transform:translateY({-gone * HIGH}px)}}")
    rolls.append(f"to{{transform:translateY({-gone * HIGH}px)}}")
    looks = "".join(f".{name}{{{look}}}" for look, name in classes.items())
    width, height = COLUMNS * WIDE + 2 * EDGE, ROWS * HIGH + TOP + EDGE
    back = "#{:02x}{:02x}{:02x}".format(*THEME.background_color)
    lights = "".join(
        f'<circle cx="{22 + 20 * n}" cy="20" r="6" fill="{colour}"/>'
        for n, colour in enumerate(("#ff5f57", "#febc2e", "#28c840"))
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}">\n'
        "<title>A person plans a garden with goalscope, and the belief moves with their words"
        "</title>\n<style>"
        "text{font:14px ui-monospace,SFMono-Regular,Menlo,Consolas,'DejaVu Sans Mono',monospace}"
        f"{looks}.s,.roll{{animation:{whole:.1f}s linear infinite}}.roll{{animation-name:roll}}"
        f"@keyframes roll{{{''.join(rolls)}}}{''.join(rules)}"
        f"@media(prefers-reduced-motion:reduce){{.s,.roll{{animation:none}}"
        f".roll{{transform:translateY({-gone * HIGH}px)}}}}</style>\n"
        f'<rect width="{width}" height="{height}" rx="10" fill="{back}"/>{lights}\n'
        f'<text x="{width / 2}" y="25" text-anchor="middle" fill="#b8b8b8">'
        f"goalscope {' '.join(COMMAND)}</text>\n"
        f'<svg x="{EDGE}" y="{TOP}" width="{COLUMNS * WIDE}" height="{ROWS * HIGH}">'
        f'<g class="roll">\n' + "\n".join(groups) + "\n</g></svg>\n</svg>\n"
    )


def main() -> None:
    """Run the command, and keep the picture."""
    Path(__file__).with_name("chat.svg").write_text(picture(recorded()), encoding="utf-8")


if __name__ == "__main__":
    main()
