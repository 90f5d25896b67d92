"""The HTML over the picture: score, clock, banners and the last call. Names in it may come from anybody."""

from html import escape
from typing import Final

from vrg.colours import hexadecimal as _css
from vrg.games import game_of
from vrg.games.game import capitalised
from vrg.ui import palette
from vrg.ui.banner import banners
from vrg.ui.headline import headline
from vrg.ui.scene import Scene


def board(scene: Scene) -> str:
    """The score and the clock in the middle above, below them what the match is about or must not be overlooked."""
    head, told = headline(scene), banners(scene)
    teams = [
        f'<div class="team" style="--c:{_css(palette.mix(team.colour, palette.TEXT, 0.15))}">'
        f"<b>{team.points}</b><div><span>{escape(team.team)}</span><i>{escape(team.words)}</i></div></div>"
        for team in head.teams
    ]
    half = (len(teams) + 1) // 2
    stage = f"{head.stage}, {head.left}" if head.left else head.stage
    middle = f'<div class="clock"><b>{head.clock}</b><span>{escape(stage)}</span></div>'
    shown = "".join((*teams[:half], middle, *teams[half:])) if scene.stage is not None else ""
    news = [
        f'<div class="banner" style="background:{_css(banner.colour)};color:{_css(palette.ink_on(banner.colour))}">'
        f"<b>{escape(banner.heading)}</b> {escape(banner.text)}</div>"
        for banner in told
    ]
    if not news:
        lines = (f"<b>{escape(head.title)}.</b> {escape(head.about)}", escape(head.count or head.drama))
        news = [f'<div class="about">{line}</div>' for line in lines if line]
    return f'<div class="vrg-top"><div class="board">{shown}</div>{"".join(news)}</div>'


def last_call(scene: Scene) -> str:
    """The last call of the referee. The browser lets it fade, and shows it anew if it is another text."""
    if not scene.calls:
        return ""
    call = scene.calls[-1]
    marked = " marked" if call.rule in game_of(scene.game).marked else ""
    return f'<div class="vrg-call{marked}">{escape(capitalised(call.text))}</div>'


STYLE: Final = f"""<style>
:root {{ --panel: {_css(palette.PANEL)}dd; --line: {_css(palette.LINE)}; --text: {_css(palette.TEXT)};
  --muted: {_css(palette.MUTED)}; --caution: {_css(palette.CAUTION)}; }}
.vrg-top, .vrg-call {{ position: fixed; pointer-events: none; color: var(--text); z-index: 5;
  font-family: "Inter", "Segoe UI", "DejaVu Sans", system-ui, sans-serif; }}
.vrg-top {{ top: 14px; left: 0; right: 0; display: flex; flex-direction: column; align-items: center; gap: 8px; }}
.board {{ display: flex; background: var(--panel); border: 1px solid var(--line); border-radius: 12px; overflow: hidden;
  box-shadow: 0 6px 24px #0008; }}
.board:empty {{ display: none; }}
.team {{ display: flex; align-items: center; gap: 12px; padding: 8px 20px; border-bottom: 4px solid var(--c); }}
.team span {{ font-size: 15px; letter-spacing: .02em; }}
.team i {{ display: block; font: 11px/1.2 sans-serif; color: var(--muted); }}
.team b {{ font-size: 30px; color: var(--c); line-height: 1; }}
.clock {{ display: flex; flex-direction: column; align-items: center; padding: 7px 22px; background: #0006; }}
.clock b {{ font-size: 26px; line-height: 1.1; font-variant-numeric: tabular-nums; }}
.clock span {{ font-size: 11px; color: var(--muted); text-transform: uppercase; letter-spacing: .12em; }}
.banner {{ padding: 7px 18px; border-radius: 9px; font-size: 15px; max-width: 76vw; box-shadow: 0 4px 16px #0006; }}
.about {{ font-size: 14px; max-width: 50vw; text-align: center; text-shadow: 0 1px 4px #000; }}
.about + .about {{ margin-top: -5px; font-weight: bold; color: var(--caution); }}
.banner b {{ margin-right: 8px; }}
.vrg-call {{ left: 50%; transform: translateX(-50%); bottom: 22px; padding: 9px 20px; border-radius: 10px;
  font-size: 17px; background: var(--panel); border: 1px solid var(--line); max-width: 70vw;
  animation: fade 9s ease-in forwards; }}
@keyframes fade {{ 0%, 80% {{ opacity: 1; }} 100% {{ opacity: 0; }} }}
.vrg-call.marked {{ border-left: 5px solid var(--caution); }}
@media (max-width: 600px), (max-height: 600px) {{
  .vrg-top {{ top: 6px; gap: 4px; }}
  .banner + .about, .board + .about, .team i {{ display: none; }}
  .team {{ gap: 8px; padding: 4px 10px; }}
  .team b, .clock b {{ font-size: 20px; }}
  .clock {{ padding: 4px 12px; text-align: center; }}
  .clock span {{ font-size: 10px; letter-spacing: .04em; }}
  .vrg-call {{ font-size: 15px; padding: 6px 14px; }}
}}
@media (max-width: 600px) {{ .vrg-call {{ bottom: auto; top: 84px; }} }}
@media (max-height: 600px) {{
  .vrg-top {{ left: 8px; align-items: flex-start; }}
  .vrg-call {{ left: 8px; transform: none; bottom: 8px; }}
}}
[data-floating-window] div:has(> p > label) {{ width: 4.2em !important; }}
[data-floating-window] div:has(> p > label:empty) {{ display: none; }}
#webgl-software-rendering, [data-testid="floating-panel-handle"] button {{ display: none; }}
</style>"""
