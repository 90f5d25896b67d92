"""The page of a class: a workshop for each student, the projector, and the teacher's console."""

import asyncio
import contextlib
import functools
import io
import itertools
import logging
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import Any, Final

import msgspec
import segno
from aiohttp import WSCloseCode, WSMsgType, web
from markdown_it import MarkdownIt
from msgspec import Struct, structs

from vrg.games import GAMES
from vrg.launch.sandbox.seal import missing
from vrg.ui.web.admission import is_token
from vrg.ui.web.parts import encode
from vrg.ui.web.site import Site
from vrg_class import requests
from vrg_class.folder import ClassFolder, Student, checked_name
from vrg_class.league import ClassLeague
from vrg_class.lesson import Step, first_code
from vrg_class.page import HELLO, Page
from vrg_class.trial import FRAME
from vrg_class.tries import Tries, Try, others_of, setup_of, teams_of

TABS: Final = 3
"""The pages that a student may have open; the oldest one goes."""
HASTE: Final = 0.5
"""The real time in s between two requests of one student that cost something."""
GUESSES: Final = 20
"""The wrong words of a roster in a minute from one address."""
TRY_SECONDS: Final = 90.0
"""The match time in s of a try of the match of the league."""
LEAGUE_EVERY: Final = 20
LEAGUE_SECONDS: Final = 4
"""The real time in s of every `LEAGUE_EVERY` s in which the league may begin games although somebody waits."""
UNKNOWN: Final = 4001
"""The code with which a connection is closed whose token is not known."""
LINK_SIZE: Final = 300
"""The number of letters of a link of which a QR code is made."""
_LEAGUE_HEADERS: Final = {
    "Content-Security-Policy": "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; frame-src 'self'"
}
"""Of the pages of the league, which are shut off from those of the class and from what browsers keep of them."""

log = logging.getLogger(__name__)


@dataclass
class Desk:
    """What is known of a student while the server runs.

    Args:
        step: the step of the last try, by its name. tried: the last try. pages: those that listen.
        last: when the last request came that costs something, s of the monotonic clock.
    """

    step: str = ""
    tried: Try | None = None
    pages: list[Page] = field(default_factory=list)
    last: float = 0.0


class ClassSite(Site):
    """Serves the pages of a class from `start` to `stop`.

    Args:
        host, port, certificate, private_key: as for `Site`. folder: of the class. lesson: its steps.
        tries: makes the queue of tries, on the server's loop. league: of the class.
    """

    def __init__(
        self,
        host: str,
        port: int,
        folder: ClassFolder,
        lesson: Sequence[Step],
        tries: Callable[[], Tries],
        league: ClassLeague,
        certificate: str = "",
        private_key: str = "",
    ) -> None:
        super().__init__(host, port, "class.html", certificate, private_key, own=files("vrg_class") / "static")
        self._folder, self._lesson, self._league = folder, {step.name: step for step in lesson}, league
        self._make_tries = tries
        self._desks: defaultdict[str, Desk] = defaultdict(Desk)
        self._markdown = MarkdownIt("commonmark", {"html": False})
        self._message, self._halted = "", False
        self._starts: dict[str, asyncio.Future[list[str]]] = {}
        self._guesses: Counter[tuple[str, int]] = Counter()
        self._first = first_code(lesson[0].path.parent) if lesson else ""
        setup = setup_of(folder.about.match, {})
        self._teams = teams_of(setup)
        self._title = GAMES.get(folder.about.game).title
        # The whole match is played for the team that the lesson ends with.
        self._team = (lesson[-1].head.team if lesson else "") or self._teams[0]

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what pages ask for."""
        self._tries = self._make_tries()
        router.add_post("/join", self._told(self._join))
        for path, kind, answer in (
            ("/me", requests.Nothing, self._me), ("/save", requests.Save, self._save),
            ("/try", requests.Try, self._try), ("/hand-in", requests.Save, self._hand_in),
            ("/start", requests.Start, self._start),
        ):  # fmt: skip
            router.add_post(path, self._told(self._of_student(kind, answer)))
        for path, act in (
            ("/teacher", self._console),
            ("/teacher/decide", self._decide),
            ("/teacher/code", self._code),
        ):
            router.add_post(path, self._told(self._of_teacher(act)))
        router.add_post("/board", self._told(self._board))
        router.add_get("/feed", self._feed)
        router.add_get("/qr.svg", self._code_of_link)
        router.add_get(r"/league/{token}/{file:[a-z]+(?:-\d+)?\.html}", self._league_page)
        self._ticking = asyncio.get_running_loop().create_task(self._tick())

    async def dismiss(self) -> None:
        """Tell the pages that this is the end."""
        self._ticking.cancel()
        self._tries.close()
        await asyncio.to_thread(self._league.close)
        for page in [page for desk in self._desks.values() for page in desk.pages]:
            with contextlib.suppress(Exception):
                await page.socket.close(code=WSCloseCode.GOING_AWAY)

    # Who asks

    def _told(self, answer: Callable[[web.Request], Any]) -> Any:
        """What answers with JSON; a ValueError is a request that cannot be granted, with the reason."""

        async def handler(request: web.Request) -> web.Response:
            if (refused := self.turned_away(request)) is not None:
                return refused
            try:
                found = await answer(request)
            except PermissionError as error:
                return web.Response(status=401, text=str(error))
            except ValueError as error:
                return web.Response(status=400, text=str(error))
            except OSError as error:
                return web.Response(status=507, text=f"the computer of the class cannot write this: {error.strerror}")
            return web.Response(text=encode(found), content_type="application/json")

        return handler

    def _of_student(
        self, kind: type[Struct], answer: Callable[[Any, Student, Desk], Any]
    ) -> Callable[[web.Request], Any]:
        async def handler(request: web.Request) -> Any:
            token, students = self.token_of(request), self._folder.students
            if token not in students:
                raise PermissionError("this link is not known: join again, or ask your teacher for your link")
            wanted = requests.read(await request.read(), kind)
            student = students[token]  # only now: what is known of a student may change until all has come
            self.let_in(request, token)
            return await answer(wanted, student, self._desks[student.token])

        return handler

    def _of_teacher(self, answer: Callable[[web.Request], Any]) -> Callable[[web.Request], Any]:
        async def handler(request: web.Request) -> Any:
            if not is_token(self.token_of(request), self._folder.about.teacher):
                raise PermissionError("this needs the teacher's link")
            self.let_in(request)
            return await answer(request)

        return handler

    # Students

    async def _join(self, request: web.Request) -> Any:
        about, wanted = self._folder.about, requests.read(await request.read(), requests.Join)
        if not is_token(self.token_of(request), about.joining):
            raise PermissionError("this needs the link of the class: scan it from the projector")
        name = checked_name(wanted.name)
        if about.roster:
            who = request.remote or "", int(time.monotonic() // 60)
            if self._guesses[who] >= GUESSES:
                raise ValueError("too many wrong words from this device: wait a minute")
            if not is_token(wanted.word, about.roster.get(name, "")):
                self._guesses[who] += 1
                raise ValueError("this name and this word are not in the roster of the class")
            student = self._folder.named(name) or self._folder.join(name)
        else:
            student = self._folder.join(name)
        self.let_in(request, "")
        return {"token": student.token, "name": student.name}

    async def _me(self, _: requests.Nothing, student: Student, desk: Desk) -> Any:
        code = self._folder.code(student) or self._first
        steps = [
            {
                "name": step.name, "title": step.head.title, "done": step.name in student.done,
                "text": self._markdown.render(step.text), "hint": step.head.hint,
            }
            for step in self._lesson.values()
        ]  # fmt: skip
        return {
            "name": student.name, "game": self._title, "code": code, "steps": steps, "step": desk.step,
            "versions": student.versions, "handed": student.handed, "message": self._message, "halted": self._halted,
            "messages": desk.tried is not None,
        }  # fmt: skip

    async def _save(self, wanted: requests.Save, student: Student, _desk: Desk) -> Any:
        self._folder.save(student, wanted.code)
        return {}

    async def _try(self, wanted: requests.Try, student: Student, desk: Desk) -> Any:
        self._hurry(desk)
        step = self._step(wanted.step)
        student = structs.replace(student, tries=student.tries + 1, error="", line=None)
        student, file = self._folder.version(student, wanted.code)
        match = self._folder.about.match if step is None else step.match
        setup_teams = self._teams if step is None else await asyncio.to_thread(lambda: teams_of(setup_of(match, {})))
        team = self._team if step is None else step.head.team or setup_teams[0]
        players = {team: str(file)}
        other = step.other if step is not None else ""
        if wanted.against:
            former = self._folder.file(student, wanted.against)
            if not former.is_file():
                raise ValueError(f"version {wanted.against} is not kept any more")
            other = str(former)
        if other:
            players |= dict.fromkeys(others_of(setup_teams, team), other)
        desk.step, token = wanted.step, student.token
        desk.tried = Try(
            owner=token, match=match, players=players, team=team,
            goal=None if step is None else step.head.goal.model_dump(exclude_none=True),
            seconds=TRY_SECONDS if step is None else step.head.seconds,
            tell=lambda text: self._hear(token, wanted.step, text),
        )  # fmt: skip
        self._show(desk, encode({"t": "begin", "step": wanted.step, "version": student.versions}))
        return {"version": student.versions, "place": self._tries.ask(desk.tried), "halted": self._halted}

    def _step(self, name: str) -> Step | None:
        """The step of a name; None for the empty one, which is the match of the league."""
        if name and name not in self._lesson:
            raise ValueError(f"expected a step of the lesson, got {name!r}")
        return self._lesson.get(name)

    def _hear(self, token: str, step: str, text: str) -> None:
        """Take in a message of a try, and show it to its student."""
        student = self._folder.students[token]
        self._show(self._desks[token], text)
        if text.startswith('{"t":"error"'):
            fault = msgspec.json.decode(text)
            self._folder.keep(structs.replace(student, error=str(fault.get("text", "")), line=fault.get("line")))
        elif text.startswith('{"t":"end"'):
            goal = msgspec.json.decode(text).get("goal") or {}
            if goal.get("reached") is not None:
                done = (*student.done, *([] if step in student.done else [step]))
                self._folder.keep(structs.replace(student, done=done, since=time.time()))

    async def _start(self, wanted: requests.Start, _student: Student, _desk: Desk) -> Any:
        """The messages of the first instant of a step, which is played once for all students."""
        name = wanted.step
        step = self._step(name)
        if name not in self._starts and self._halted:
            return []
        if name not in self._starts:
            match = self._folder.about.match if step is None else step.match
            found: asyncio.Future[list[str]] = asyncio.get_running_loop().create_future()
            one = Try(
                owner=f"start {name}", match=match, players={}, team=self._team if step is None else step.head.team,
                goal=None, seconds=2 * FRAME,
                tell=lambda text: found.set_result(one.messages) if text.startswith('{"t":"end"') else None,
            )  # fmt: skip
            found.add_done_callback(lambda _: one.messages[0].startswith('{"t":"about"') or self._starts.pop(name))
            self._starts[name] = found
            self._tries.ask(one)
        return [msgspec.Raw(text.encode()) for text in await asyncio.shield(self._starts[name])]

    async def _hand_in(self, wanted: requests.Save, student: Student, desk: Desk) -> Any:
        self._hurry(desk)
        student, _ = self._folder.version(student, wanted.code, handed=True)
        self._league.renew()
        return {"version": student.handed}

    def _hurry(self, desk: Desk) -> None:
        now = time.monotonic()
        if now - desk.last < HASTE:
            raise ValueError("that was very quick: wait a moment")
        desk.last = now

    def _show(self, desk: Desk, text: str) -> None:
        for page in desk.pages:
            page.send(text)

    async def _feed(self, request: web.Request) -> web.StreamResponse:
        if (refused := self.turned_away(request)) is not None:
            return refused
        socket = web.WebSocketResponse(max_msg_size=1000, heartbeat=20.0)
        await socket.prepare(request)
        try:
            hello = await asyncio.wait_for(socket.receive(), HELLO)
        except TimeoutError:
            await socket.close()
            return socket
        student = self._folder.students.get(hello.data) if hello.type is WSMsgType.TEXT else None
        if student is None:
            await socket.close(code=UNKNOWN, message=b"this link is not known")
            return socket
        self.let_in(request)
        desk, page = self._desks[student.token], Page(socket)
        desk.pages.append(page)
        while len(desk.pages) > TABS:
            await desk.pages.pop(0).socket.close(code=WSCloseCode.POLICY_VIOLATION, message=b"too many pages")
        page.send(encode({"t": "news", "message": self._message, "halted": self._halted}))
        if desk.tried is not None:  # what a closed page has missed
            page.send(encode({"t": "begin", "step": desk.step, "version": student.versions}))
            for text in desk.tried.messages:
                page.send(text)
        sending = asyncio.get_running_loop().create_task(page.serve())
        try:
            async for _ in socket:
                pass  # a page has nothing to tell
        finally:
            sending.cancel()
            with contextlib.suppress(ValueError):
                desk.pages.remove(page)
            await socket.close()
        return socket

    # The projector and the teacher

    async def _code_of_link(self, request: web.Request) -> web.Response:
        """A QR code of a text."""
        if (refused := self.turned_away(request)) is not None:
            return refused
        code = await asyncio.to_thread(_qr, request.query.get("text", "")[:LINK_SIZE])
        return web.Response(body=code, content_type="image/svg+xml")

    async def _board(self, request: web.Request) -> Any:
        token, about, students = self.token_of(request), self._folder.about, self._folder.students
        student = students.get(token)
        if student is None and not is_token(token, about.joining):
            raise PermissionError("this needs the link of the class")
        self.let_in(request, "" if student is None else token)
        return {
            "game": self._title, "rows": self._league.board, "games": self._league.games, "message": self._message,
            "halted": self._halted, "students": len(students), "done": sum(len(one.done) for one in students.values()),
            "pages": f"league/{about.joining}/index.html" if self._league.games else "",
            "problem": self._league.problem(student) if student is not None else "",
        }  # fmt: skip

    async def _league_page(self, request: web.Request) -> web.Response:
        """A page of the league. The token is in its address, so that its links lead to others."""
        if not is_token(request.match_info["token"], self._folder.about.joining):
            raise web.HTTPNotFound
        self.let_in(request, "")
        try:
            body = await asyncio.to_thread((self._folder.league / "pages" / request.match_info["file"]).read_bytes)
        except OSError:
            raise web.HTTPNotFound from None
        return web.Response(body=body, content_type="text/html", charset="utf-8", headers=_LEAGUE_HEADERS)

    async def _console(self, _request: web.Request) -> Any:
        found = [
            {
                "name": student.name, "here": bool(self._desks[student.token].pages), "done": len(student.done),
                "step": next((name for name in self._lesson if name not in student.done), ""),
                "stuck": round(time.time() - student.since),
                "tries": student.tries, "error": student.error, "line": student.line, "handed": student.handed,
                "link": student.token,
            }
            for student in self._folder.students.values()
        ]  # fmt: skip
        return {
            "students": found, "message": self._message, "halted": self._halted, "busy": self._tries.busy,
            "jobs": self._tries.jobs, "sealed": self._tries.sealed, "lacking": missing() or "",
            "lesson": len(self._lesson),
        }  # fmt: skip

    async def _code(self, request: web.Request) -> Any:
        student = self._folder.named(requests.read(await request.read(), requests.Join).name)
        if student is None:
            raise ValueError("there is no such student")
        return {"code": self._folder.code(student)}

    async def _decide(self, request: web.Request) -> Any:
        wanted = requests.read(await request.read(), requests.Decide)
        if wanted.halted is not None:
            self._halted = wanted.halted
            self._tries.halt(halted=wanted.halted)
        if wanted.message is not None:
            self._message = wanted.message
        news = encode({"t": "news", "message": self._message, "halted": self._halted})
        for desk in self._desks.values():
            self._show(desk, news)
        return {}

    async def _tick(self) -> None:
        """Let the league play while no student waits, and now and then although one does."""
        for second in itertools.count():
            await asyncio.sleep(1.0)
            self._guesses = Counter({who: n for who, n in self._guesses.items() if who[1] >= time.monotonic() // 60})
            busy = self._tries.busy > 0 and second % LEAGUE_EVERY >= LEAGUE_SECONDS
            try:
                await asyncio.to_thread(self._league.rest, rests=busy or self._halted)
            except Exception:  # the class goes on without its league
                log.exception("the league cannot go on")


@functools.lru_cache(maxsize=256)
def _qr(text: str) -> bytes:
    """The picture of a text that telephones read, as SVG."""
    found = io.BytesIO()
    segno.make(text or "-", error="m").save(found, kind="svg", scale=8, border=2, dark="#000", light="#fff")
    return found.getvalue()
