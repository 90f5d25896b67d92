"""The teacher's console: who is stuck on what, who is in the class, and a word to all."""

import secrets
import time
from collections.abc import Callable, Mapping
from typing import Any

from aiohttp import web
from msgspec import structs

from vrg.launch.sandbox.seal import missing
from vrg.ui.web.admission import TOKEN_BYTES, is_token
from vrg_class import requests
from vrg_class.classroom import CHANGED, UNKNOWN, Classroom, name_of
from vrg_class.folder import Student, alike
from vrg_class.league import ClassLeague
from vrg_class.lesson import Step
from vrg_class.site import DaySite, RefusalError, language_of, read
from vrg_class.tries import Tries


class Console:
    """Answers the teacher's page.

    Args:
        room: the class. lesson: its steps by name. tries: its queue. league: of the class.
    """

    def __init__(self, room: Classroom, lesson: Mapping[str, Step], tries: Tries, league: ClassLeague) -> None:
        self._room, self._folder, self._lesson = room, room.folder, lesson
        self._tries, self._league = tries, league
        self._languages = {tag for step in lesson.values() for tag in step.languages}

    def add_routes(self, router: web.UrlDispatcher, site: DaySite) -> None:
        """Add what the teacher's page asks for."""
        for path, act in (
            ("/teacher", self._look), ("/teacher/decide", self._decide), ("/teacher/code", self._code),
            ("/teacher/change", self._change),
        ):  # fmt: skip
            router.add_post(path, site.told(self._of_teacher(site, act)))

    def _of_teacher(self, site: DaySite, answer: Callable[[web.Request], Any]) -> Callable[[web.Request], Any]:
        async def handler(request: web.Request) -> Any:
            if not is_token(site.token_of(request), self._folder.about.teacher):
                raise RefusalError("teacher-link", 401)
            site.let_in(request)
            return await answer(request)

        return handler

    async def _look(self, request: web.Request) -> Any:
        language = language_of(request, self._languages)
        found = [
            {
                "name": student.name, "id": student.folder, "here": bool(self._room.desks[student.folder].pages),
                "done": student.done, "step": next((name for name in self._lesson if name not in student.done), ""),
                "stuck": round(time.time() - student.since),
                "tries": student.tries, "error": student.error, "line": student.line, "handed": student.handed,
                "link": student.token, "problem": self._league.problem(student),
            }
            for student in self._folder.students.values()
        ]  # fmt: skip
        return {
            "students": found, "message": self._room.message, "halted": self._room.halted,
            "closed": self._room.closed, "busy": self._tries.busy,
            "jobs": self._tries.jobs, "sealed": self._tries.sealed, "lacking": missing() or "",
            "steps": {name: step.told(language).title for name, step in self._lesson.items()},
            "absent": [name for name in self._folder.about.roster if self._folder.named(name) is None],
            "problems": self._folder.problems, "roster": self._room.roster_problem,
        }  # fmt: skip

    async def _decide(self, request: web.Request) -> Any:
        wanted = await read(request, requests.Decide)
        if wanted.halted is not None:
            self._room.halted = wanted.halted
            self._tries.halt(halted=wanted.halted)
        if wanted.closed is not None:
            self._room.closed = wanted.closed
        if wanted.message is not None:
            self._room.message = wanted.message
        for desk in self._room.desks.values():
            desk.show(self._room.news)
        return {}

    async def _code(self, request: web.Request) -> Any:
        student = self._student(await read(request, requests.OfStudent))
        return {"code": await self._room.write(self._folder.code, student)}

    def _student(self, wanted: requests.OfStudent | requests.Change) -> Student:
        if (student := self._folder.students.get(wanted.student)) is None:
            raise RefusalError("student", 404)
        return student

    async def _change(self, request: web.Request) -> Any:
        """Change who is in the class. All pages with a former link are closed."""
        wanted = await read(request, requests.Change)
        if wanted.act == "add":
            added = await self._room.write(self._room.joined, name_of(wanted.name))
            return {"id": added.folder, "link": added.token}
        await self._room.write(self._changed, wanted)
        self._league.forget_names()
        desk = self._room.desks[wanted.student]
        if wanted.act in ("remove", "reset") and desk.tried is not None:
            desk.tried.drop()
            desk.tried, desk.step = None, ""
        pages, desk.pages = desk.pages, []
        for page in pages:
            page.leave(UNKNOWN if wanted.act in ("remove", "revoke") else CHANGED)
        known = self._folder.students.get(wanted.student)
        return {} if known is None else {"link": known.token}

    def _changed(self, wanted: requests.Change) -> None:
        """Do what the teacher wants with a student; on the thread of the folder."""
        place, student = self._folder, self._student(wanted)
        match wanted.act:
            case "rename":
                name, known_as = name_of(wanted.name), student.known_as or student.name
                others = [other for other in place.about.roster if alike(other) != alike(known_as)]
                if place.named(name) not in (None, student) or alike(name) in map(alike, others):
                    raise RefusalError("taken", name=name)
                place.keep(structs.replace(student, name=name, known_as=known_as))
            case "remove":
                place.remove(student)
            case "revoke":
                place.keep(structs.replace(student, token=secrets.token_urlsafe(TOKEN_BYTES), device=""))
            case "reset":
                student = place.save(student, "", apart=True)
                place.keep(structs.replace(student, done=(), tries=0, error="", line=None, since=time.time()))
