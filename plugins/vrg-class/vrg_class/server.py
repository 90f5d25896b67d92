"""The pages of a class: a workshop for each student, the projector, and the teacher's console."""

import asyncio
import contextlib
import hashlib
import itertools
import logging
import time
from collections.abc import Callable, Sequence
from typing import Any, Final

import msgspec
from aiohttp import WSCloseCode, WSMsgType, web
from markdown_it import MarkdownIt
from msgspec import Struct

from vrg.games import GAMES
from vrg.ui.web.admission import is_token
from vrg.ui.web.parts import encode
from vrg_class import requests
from vrg_class.classroom import UNKNOWN, Classroom, Desk, name_of
from vrg_class.console import Console
from vrg_class.faults import Fault, fault_of
from vrg_class.folder import CODE_SIZE, ClassFolder, Student, revision
from vrg_class.league import ClassLeague
from vrg_class.lesson import Step, first_code, languages
from vrg_class.links import Served
from vrg_class.page import HELLO, Page
from vrg_class.roster import Guesses, listed
from vrg_class.site import DaySite, RefusalError, language_of, read
from vrg_class.trial import FRAME, kind_of
from vrg_class.tries import Tries, Try, others_of, setup_of, teams_of

TABS: Final = 3
"""The pages that a student may have open; the oldest one goes."""
HASTE: Final = 0.5
"""The real time in s between two requests of one student that cost something."""
TRY_SECONDS: Final = 90.0
"""The match time in s of a try of the match of the league."""
LEAGUE_EVERY: Final = 20
LEAGUE_SECONDS: Final = 4
"""The real time in s of every `LEAGUE_EVERY` s in which the league may begin games although somebody waits."""
_LEAGUE_HEADERS: Final = {
    "Content-Security-Policy": "sandbox allow-scripts; default-src 'none'; style-src 'unsafe-inline'; "
    "script-src 'unsafe-inline'; frame-src 'self'"
}
"""The policy of the league's pages, which cannot reach those of the class, nor what browsers store for them."""

log = logging.getLogger(__name__)


class ClassSite(DaySite):
    """Serves the pages of a class from `start` to `stop`.

    Args:
        at: where. folder: of the class. lesson: its steps. tries: makes the queue of tries, on the server's loop.
        league: of the class.
    """

    def __init__(
        self, at: Served, folder: ClassFolder, lesson: Sequence[Step], tries: Callable[[], Tries], league: ClassLeague
    ) -> None:
        super().__init__(at, "class.html")
        self._folder, self._lesson, self._league = folder, {step.name: step for step in lesson}, league
        self._make_tries = tries
        self._room = Classroom(folder)
        self._markdown = MarkdownIt("commonmark", {"html": False})
        self._starts: dict[str, asyncio.Future[list[str]]] = {}
        self._guesses = Guesses()
        self._home = lesson[0].path.parent if lesson else None
        self._languages = languages(self._home) if self._home else frozenset[str]()
        setup = setup_of(folder.about.match, {})
        self._teams = teams_of(setup)
        self._title = GAMES.get(folder.about.game).title
        # The whole match is played for the team that the lesson ends with.
        self._team = (lesson[-1].head.team if lesson else "") or self._teams[0]
        self._games_key = hashlib.sha256(folder.about.joining.encode()).hexdigest()[:20]
        if self._home is not None:
            first_code(self._home, "")

    def add_routes(self, router: web.UrlDispatcher) -> None:
        """Add what pages ask for."""
        super().add_routes(router)
        self._tries = self._make_tries()
        router.add_post("/join", self.told(self._join))
        for path, kind, answer in (
            ("/me", requests.Nothing, self._me), ("/save", requests.Save, self._take),
            ("/try", requests.Try, self._try), ("/hand-in", requests.Save, self._hand_in),
            ("/start", requests.Start, self._start), ("/versions", requests.Nothing, self._versions),
            ("/version", requests.OfVersion, self._version),
        ):  # fmt: skip
            router.add_post(path, self.told(self._of_student(kind, answer)))
        Console(self._room, self._lesson, self._tries, self._league).add_routes(router, self)
        router.add_post("/board", self.told(self._board))
        router.add_get("/feed", self._feed)
        router.add_get(r"/league/{token}/{file:[a-z]+(?:-\d+)?\.html}", self._league_page)
        self._ticking = asyncio.get_running_loop().create_task(self._tick())

    async def dismiss(self) -> None:
        """Tell the pages that this is the end."""
        self._ticking.cancel()
        self._tries.close()
        for page in [page for desk in self._room.desks.values() for page in desk.pages]:
            page.leave(WSCloseCode.GOING_AWAY)
        await asyncio.to_thread(self._league.close)
        await asyncio.to_thread(self._room.disk.shutdown)

    # Who asks

    def _of_student(
        self, kind: type[Struct], answer: Callable[[Any, Student, Desk], Any]
    ) -> Callable[[web.Request], Any]:
        async def handler(request: web.Request) -> Any:
            token = self.token_of(request)

            def asking() -> Student:
                return _known(self._folder.of_token(token))

            asking()
            wanted = await read(request, kind)
            student = asking()
            self.let_in(request, student.folder)
            desk = self._room.desks[student.folder]
            desk.language = language_of(request, self._languages)

            async def found() -> Any:
                # What is known of a student may have changed until it is its turn.
                return await answer(wanted, asking(), desk)

            # The field of a step is played once for all, and may take its time.
            return await (found() if kind is requests.Start else desk.answered(found))

        return handler

    # Students

    async def _join(self, request: web.Request) -> Any:
        about, wanted = self._folder.about, await read(request, requests.Join)
        if not is_token(self.token_of(request), about.joining):
            raise RefusalError("joining-link", 401)
        self.let_in(request, "")  # before the disk is waited for: an answer that is lost leaves the name taken
        name = name_of(wanted.name)
        if self._room.closed and self._folder.named(name) is None:
            raise RefusalError("closed")
        if about.roster:
            if self._guesses.are_over(name, wanted.device, time.monotonic()):
                raise RefusalError("guesses")
            known = listed(about.roster, name, wanted.word)
            if known is None:
                self._guesses.add(name, wanted.device)
                raise RefusalError("roster")
            student = self._folder.named(known)
            if student is None:
                student = await self._room.write(self._room.joined, known)
        else:
            student = await self._room.write(self._room.joined, name, wanted.device)
        return {"token": student.token, "name": student.name}

    async def _me(self, _wanted: requests.Nothing, student: Student, desk: Desk) -> Any:
        kept = await self._room.write(self._folder.code, student)
        steps = [
            {
                "name": step.name, "title": told.title, "done": step.name in student.done,
                "text": self._markdown.render(told.text), "hint": told.hint,
            }
            for step in self._lesson.values()
            for told in [step.told(desk.language)]
        ]  # fmt: skip
        return {
            "id": student.folder, "name": student.name, "game": self._title,
            "code": kept or self._first(desk), "revision": revision(kept), "steps": steps, "step": desk.step,
            "versions": student.versions, "handed": student.handed, "problem": self._problem(student),
            "message": self._room.message, "halted": self._room.halted, "messages": desk.tried is not None,
        }  # fmt: skip

    def _problem(self, student: Student) -> Fault | None:
        """Why what a student has handed in last does not play; None if it does."""
        words = self._league.problem(student)
        return fault_of(words, f"{student.folder}.py") if words else None

    def _first(self, desk: Desk) -> str:
        """The code with which a student begins."""
        return "" if self._home is None else first_code(self._home, desk.language)

    async def _take(self, wanted: requests.Save, student: Student, desk: Desk, *, as_version: bool = False) -> Any:
        """Save code, and tell the other pages of its student; what is known of it then.

        Raises:
            RefusalError: it was made from code that is not the newest one. Both are kept as versions.
        """
        if len(wanted.code) > CODE_SIZE:
            raise RefusalError("long", 413, most=CODE_SIZE)
        found = await self._room.write(self._taken, wanted, student.folder, as_version, desk)
        desk.show(encode({"t": "saved", "code": wanted.code, "revision": found["revision"]}))
        return found

    def _taken(self, wanted: requests.Save, folder: str, as_version: bool, desk: Desk) -> dict[str, Any]:
        """See `_take`; on the thread of the folder."""
        place, student = self._folder, _known(self._folder.students.get(folder))
        now = place.code(student)
        if wanted.code != now and wanted.base != revision(now):
            for code in filter(None, (now, wanted.code)):
                student = place.version(student, code)
            raise RefusalError("stale", 409, code=now or self._first(desk), revision=revision(now))
        student = place.save(student, wanted.code, apart=wanted.apart)
        if as_version:
            student = place.version(student, wanted.code)
        return {"revision": revision(wanted.code), "version": student.versions}

    async def _versions(self, _wanted: requests.Nothing, student: Student, _desk: Desk) -> Any:
        found, now = await self._room.write(self._folder.versions, student), time.time()
        return [
            {"number": v.number, "age": round(now - v.made), "lines": v.lines, "handed": v.number == student.handed}
            for v in found
        ]  # fmt: skip

    async def _version(self, wanted: requests.OfVersion, student: Student, _desk: Desk) -> Any:
        file = self._folder.file(student, wanted.number)
        if not file.is_file():
            raise RefusalError("version", number=wanted.number)
        return {"code": (await self._room.write(file.read_bytes)).decode("utf-8", "replace")}

    async def _try(self, wanted: requests.Try, student: Student, desk: Desk) -> Any:
        self._hurry(desk)
        step = self._step(wanted.step)
        taken = await self._take(wanted, student, desk, as_version=True)
        file = self._folder.file(student, taken["version"])
        await self._room.write(self._folder.change, student.folder, tries=student.tries + 1, error="", line=None)
        match = self._folder.about.match if step is None else step.match
        setup_teams = self._teams if step is None else await asyncio.to_thread(lambda: teams_of(setup_of(match, {})))
        team = self._team if step is None else step.head.team or setup_teams[0]
        players = {team: str(file)}
        other = step.other if step is not None else ""
        if wanted.against:
            former = self._folder.file(student, wanted.against)
            if not former.is_file():
                raise RefusalError("version", number=wanted.against)
            other = str(former)
        if other:
            players |= dict.fromkeys(others_of(setup_teams, team), other)
        desk.step, owner = wanted.step, student.folder
        desk.tried = Try(
            owner=owner, match=match, players=players, team=team,
            goal=None if step is None else step.head.goal.model_dump(exclude_none=True),
            seconds=TRY_SECONDS if step is None else step.head.seconds,
            tell=lambda text: self._hear(owner, wanted.step, text),
        )  # fmt: skip
        desk.tried.add(encode({"t": "begin", "step": wanted.step, "version": taken["version"]}))
        return {**taken, "place": self._tries.ask(desk.tried), "halted": self._room.halted}

    def _step(self, name: str) -> Step | None:
        """The step of a name; None for the empty one, which is the match of the league."""
        if name and name not in self._lesson:
            raise RefusalError("step")
        return self._lesson.get(name)

    def _hear(self, folder: str, step: str, text: str) -> None:
        """Take in a message of a try, and show it to its student."""
        self._room.desks[folder].show(text)
        kind, found = kind_of(text), {}
        if kind in ("error", "end"):
            found = msgspec.json.decode(text)
        if kind == "error":
            error, line = str(found.get("text", "")), found.get("line")
            self._room.disk.submit(self._folder.change, folder, error=error, line=line)
        elif kind == "end" and (found.get("goal") or {}).get("reached") is not None:
            self._room.disk.submit(self._done, folder, step)

    def _done(self, folder: str, step: str) -> None:
        """Take in that a student has reached the goal of a step; on the thread of the folder."""
        student = self._folder.students.get(folder)
        if student is not None:
            done = (*student.done, *([] if step in student.done else [step]))
            self._folder.change(folder, done=done, since=time.time())

    async def _start(self, wanted: requests.Start, _student: Student, _desk: Desk) -> Any:
        """The messages of the first instant of a step, which is played once for all students."""
        name = wanted.step
        step = self._step(name)
        if name not in self._starts and self._room.halted:
            return []
        if name not in self._starts:
            match = self._folder.about.match if step is None else step.match
            found: asyncio.Future[list[str]] = asyncio.get_running_loop().create_future()
            one = Try(
                owner=f"start {name}", match=match, players={}, team=self._team if step is None else step.head.team,
                goal=None, seconds=2 * FRAME,
                tell=lambda text: found.set_result(one.messages) if kind_of(text) == "end" else None,
            )  # fmt: skip
            found.add_done_callback(lambda _: kind_of(one.messages[0]) == "about" or self._starts.pop(name))
            self._starts[name] = found
            self._tries.ask(one)
        return [msgspec.Raw(text.encode()) for text in await asyncio.shield(self._starts[name])]

    async def _hand_in(self, wanted: requests.Save, student: Student, desk: Desk) -> Any:
        self._hurry(desk)
        taken = await self._take(wanted, student, desk, as_version=True)
        await self._room.write(self._handed, student.folder)
        self._league.renew()
        return taken

    def _handed(self, folder: str) -> None:
        """Let the newest version of a student play in the league; on the thread of the folder."""
        self._folder.hand_in(_known(self._folder.students.get(folder)))

    def _hurry(self, desk: Desk) -> None:
        now = time.monotonic()
        if now - desk.last < HASTE:
            raise RefusalError("haste")
        desk.last = now

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
        student = self._folder.of_token(hello.data) if hello.type is WSMsgType.TEXT else None
        if student is None:
            await socket.close(code=UNKNOWN, message=b"this link is not known")
            return socket
        self.let_in(request)
        desk, page = self._room.desks[student.folder], Page(socket, request.transport)
        desk.pages.append(page)
        while len(desk.pages) > TABS:
            desk.pages.pop(0).leave(WSCloseCode.POLICY_VIOLATION)
        page.send(self._room.news)
        if desk.tried is not None:  # what a closed page has missed
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

    async def _board(self, request: web.Request) -> Any:
        token, about, students = self.token_of(request), self._folder.about, self._folder.students
        student = self._folder.of_token(token)
        if student is None and not is_token(token, about.joining):
            raise RefusalError("joining-link", 401)
        self.let_in(request, "" if student is None else student.folder)
        return {
            "game": self._title, "rows": self._league.board, "games": self._league.games,
            "message": self._room.message, "halted": self._room.halted,
            "students": len(students), "done": sum(len(one.done) for one in students.values()),
            "pages": f"league/{self._games_key}/index.html" if self._league.games else "",
        }  # fmt: skip

    async def _league_page(self, request: web.Request) -> web.Response:
        """A page of the league. A token that opens nothing else is in its address, so that its links lead to others."""
        if not is_token(request.match_info["token"], self._games_key):
            raise web.HTTPNotFound
        self.let_in(request, "")
        try:
            body = await asyncio.to_thread((self._folder.league / "pages" / request.match_info["file"]).read_bytes)
        except OSError:
            raise web.HTTPNotFound from None
        return web.Response(body=body, content_type="text/html", charset="utf-8", headers=_LEAGUE_HEADERS)

    async def _tick(self) -> None:
        """Let the league play while no student waits, and now and then although one does; and look at the disk."""
        for second in itertools.count():
            await asyncio.sleep(1.0)
            busy = self._tries.busy > 0 and second % LEAGUE_EVERY >= LEAGUE_SECONDS
            try:
                await asyncio.to_thread(self._league.rest, rests=busy or self._room.halted)
            except Exception:  # the class goes on without its league
                log.exception("the league cannot continue")
            for student in self._folder.students.values():
                desk, problem = self._room.desks[student.folder], self._league.problem(student)
                if problem != desk.problem:
                    desk.problem = problem
                    desk.show(encode({"t": "plays", "problem": self._problem(student)}))
            try:
                await self._room.write(self._room.look_at_disk)
            except OSError as error:
                log.warning("what is known of students cannot be written yet: %s", error)
            except Exception:  # nor does the class end because of its disk
                log.exception("the folder of the class cannot be looked at")


def _known(student: Student | None) -> Student:
    """A student who is still there.

    Raises:
        RefusalError: there is none.
    """
    if student is None:
        raise RefusalError("unknown", 401)
    return student
