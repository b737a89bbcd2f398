"""Episodes that are saved as a page."""

import re
from base64 import b64encode
from hashlib import sha256

from goalscope.web.exports import ribbons
from goalscope.web.views import BeliefView, GoalView

CAKE = "I want to bake a cake. Please add flour."


def test_a_saved_page_is_drawn_and_runs_nothing(address: str, visit) -> None:
    ann = visit(address)
    mine = ann.begin()
    ann.say(mine, CAKE)
    ann.say(mine, "Also <script>alert(1)</script> <b>milk</b>, please.")
    page = ann.http.get(f"{mine}/export.html").text
    (style,) = re.findall("<style>(.*?)</style>", page, re.DOTALL)
    allowed = b64encode(sha256(style.encode()).digest()).decode()
    assert f"default-src 'none'; style-src 'sha256-{allowed}'; img-src data:" in page
    assert not re.search(r"<script|<link|\sstyle=|\son\w+=|https?://", page.replace(style, ""))
    belief = ann.get(mine)["rounds"][-1]["belief"]
    paths = re.findall(r'<path class="ribbon (\w+)" d="M0.0 ', page)
    assert len(paths) >= len(belief["goals"])
    assert paths[-1] == "unspecified"
    assert "None of these yet" in page
    assert "&lt;script&gt;alert(1)" in page


def test_ribbons_fill_the_height_and_lie_on_each_other() -> None:
    def belief(*goals: tuple[str, float]) -> BeliefView:
        views = [
            GoalView(text=text, probability=p, unspecified=text == "Unspecified", pinned=False)
            for text, p in goals
        ]
        return BeliefView(goals=views, entropy=0.0, set_90=None, degenerate=False)

    drawn = ribbons([
        belief(("Unspecified", 0.6), ("tea", 0.4)),
        belief(("soup", 0.5), ("tea", 0.25), ("Unspecified", 0.25)),
    ])  # fmt: skip
    assert [each.goal for each in drawn] == ["tea", "soup", "Unspecified"]
    heights = [[float(y) for y in re.findall(r"[-\d.]+ ([\d.]+)", each.path)] for each in drawn]
    assert [(min(each), max(each)) for each in heights] == [(0, 40), (25, 75), (40, 100)]
    assert len({each.colour for each in drawn}) == 3
