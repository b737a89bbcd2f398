"""The HTTP interface of the page: episodes, utterances, corrections and the belief."""

from __future__ import annotations

import asyncio
from asyncio import wrap_future
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Any

from fastapi import FastAPI, Query, Security
from fastapi.exceptions import RequestValidationError
from fastapi.responses import FileResponse, Response, StreamingResponse
from fastapi.security import HTTPBearer
from fastapi.staticfiles import StaticFiles
from pydantic import BaseModel
from starlette.exceptions import HTTPException

from goalscope.agent.agent import Ablation
from goalscope.agent.planner import replay
from goalscope.agent.round import Round
from goalscope.agent.settings import Settings, settings_of
from goalscope.base.text import model_shown
from goalscope.base.types import ConflictError, Goal, GoalscopeError, InvalidInputError
from goalscope.belief.explain import reasons
from goalscope.belief.tracker import Correction
from goalscope.envs.registry import (
    BUILT_IN,
    View,
    domain_named,
    open_environment,
    profile_named,
    task_of,
)
from goalscope.models import Model, model_name
from goalscope.storage.store import EpisodeInfo, Store
from goalscope.storage.tracking import Trackers
from goalscope.web.conversations import Conversation, Conversations
from goalscope.web.guard import ErrorBody, error_response
from goalscope.web.study import study_router
from goalscope.web.tracking import Operation, Tracking
from goalscope.web.views import EpisodeView, Live, RequestBody, StoredEpisode, Why

STATIC = Path(__file__).parent / "static"
KEEPALIVE = 15.0
"""Seconds after which a silent stream of events sends a comment."""
ERRORS = (400, 401, 403, 404, 405, 409, 413, 422, 503)

METHODS: dict[Ablation, str] = {
    "good": "infers goals, and plans for the likeliest",
    "no-inference": "asks the model which goal is likeliest",
    "no-goals": "plans from your words alone",
}


class NewEpisode(RequestBody):
    """The episode to start, by default in the first domain."""

    domain: str | None = None
    method: Ablation = "good"
    scene: str | None = None


class NewUtterance(RequestBody):
    """A person's words in a round; `confirmed` is the fingerprint of a confirmed state."""

    text: str
    round: int
    confirmed: str = ""


class NewCorrection(RequestBody):
    """A correction of a goal; see `Agent.correct`."""

    kind: Correction
    goal: str
    text: str = ""


class EpisodeId(BaseModel):
    """The id of the new episode."""

    id: str


class DomainView(BaseModel):
    """A domain that the agent can act in; `view` is how its states are shown."""

    name: str
    title: str
    about: str
    view: View
    scenes: list[str]


class MethodView(BaseModel):
    """A method of the agent."""

    name: Ablation
    about: str


class Options(BaseModel):
    """The available options."""

    version: str
    model: str
    domains: list[DomainView]
    methods: list[MethodView]


class EpisodeList(BaseModel):
    """A page of episodes, newest first, of `total`; `domains` are those of all episodes."""

    episodes: list[EpisodeView]
    total: int
    domains: list[str]


class EpisodeState(StoredEpisode):
    """An episode with its rounds, and its live state if it can be continued here."""

    live: Live | None


class WordEvidence(BaseModel):
    """The evidence of each word of an utterance, in nats."""

    words: list[tuple[str, float]]


def create_app(
    store: Store,
    model: Model,
    defaults: Settings | None = None,
    domains: Sequence[str] = BUILT_IN,
) -> FastAPI:
    """The application, without access control: wrap it in a `Guard`.

    Args:
        store: Store of the episodes.
        model: Shared by all conversations.
        defaults: Settings of new episodes, besides domain, method and scene.
        domains: Names of the domains to act in; see `load_domain`. No others are opened, and no
            files are run, whatever a request names.
    """
    settings = defaults or Settings()
    conversations = Conversations(store, model)
    tasks = {name: task_of(replace(settings, domain=name)) for name in domains}
    views = {name: _domain(name, task) for name, task in tasks.items()}

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncGenerator[None]:
        yield
        await asyncio.to_thread(conversations.close)

    app = FastAPI(
        title="goalscope", version=version("goalscope"), lifespan=lifespan,
        docs_url=None, redoc_url=None, openapi_url="/api/openapi.json",
        responses={status: {"model": ErrorBody} for status in ERRORS},
        dependencies=[Security(HTTPBearer(scheme_name="key", auto_error=False))],
    )  # fmt: skip
    app.mount("/static", StaticFiles(directory=STATIC), name="static")

    def stored(id: str) -> EpisodeInfo:
        info = store.episode(id)
        if info.id != id:
            raise InvalidInputError(f"There is no episode {id!r}.")
        return info

    def running(id: str, *, again: bool = False) -> Conversation:
        info = stored(id)
        if info.ended:
            raise ConflictError("This episode has ended. Start a new one.")
        if not can_go_on(info):
            raise ConflictError("This episode cannot be continued on the page.")
        return conversations.resume(info, again=again)

    def can_go_on(info: EpisodeInfo) -> bool:
        """Not with a simulated person, files of one's own, or beliefs of another model."""
        known = info.profile is None and info.domain in views
        return known and not info.ended and info.model == model_name(model)

    @app.get("/", include_in_schema=False)
    def page() -> FileResponse:
        return FileResponse(STATIC / "index.html")

    @app.get("/api/options")
    def options() -> Options:
        return Options(
            version=version("goalscope"),
            model=model_shown(model_name(model)),
            domains=list(views.values()),
            methods=[MethodView(name=name, about=about) for name, about in METHODS.items()],
        )

    @app.get("/api/episodes")
    def episodes(
        text: str = "",
        domain: str | None = None,
        limit: Annotated[int, Query(ge=1, le=200)] = 50,
        offset: Annotated[int, Query(ge=0, le=10**9)] = 0,
    ) -> EpisodeList:
        found = store.episodes(
            domain=domain, text=text, newest_first=True, limit=limit, offset=offset
        )
        return EpisodeList(
            episodes=[EpisodeView.model_validate(info) for info in found],
            total=store.count(domain=domain, text=text),
            domains=store.domains(),
        )

    @app.post("/api/episodes", status_code=201)
    def begin(body: NewEpisode) -> EpisodeId:
        name = next(iter(views)) if body.domain is None else body.domain
        if name not in views:
            raise InvalidInputError(f"There is no domain {name!r} here, but {', '.join(views)}.")
        if body.scene is not None and body.scene not in views[name].scenes:
            raise InvalidInputError(f"There is no scene {body.scene!r}.")
        chosen = replace(settings, domain=name, method=body.method, scene=body.scene)
        return EpisodeId(id=conversations.begin(chosen).id)

    @app.get("/api/episodes/{id}")
    def episode(id: str) -> EpisodeState:
        info = stored(id)
        live = conversations.resume(info).live() if can_go_on(info) else None
        info = stored(id)  # it may have ended meanwhile
        view = StoredEpisode.of(info, store.rounds(info.id))
        return EpisodeState(**dict(view), live=None if info.ended else live)

    @app.get("/api/episodes/{id}/events", response_class=StreamingResponse)
    async def events(id: str) -> StreamingResponse:
        conversation = await asyncio.to_thread(running, id, again=True)
        return StreamingResponse(_stream(conversation), media_type="text/event-stream")

    @app.post("/api/episodes/{id}/utterances", status_code=202)
    def say(id: str, body: NewUtterance) -> Live:
        return running(id).say(body.text, body.round, body.confirmed)

    @app.post("/api/episodes/{id}/corrections")
    async def correct(id: str, body: NewCorrection) -> Live:
        conversation = await asyncio.to_thread(running, id)
        await wrap_future(conversation.correct(body.kind, body.goal, body.text))
        return conversation.live()

    @app.delete("/api/episodes/{id}/corrections")
    async def undo_correction(id: str) -> Live:
        conversation = await asyncio.to_thread(running, id)
        await wrap_future(conversation.undo_correction())
        return conversation.live()

    @app.get("/api/episodes/{id}/why")
    def why(id: str, goal: str, round: int | None = None) -> Why:
        info = stored(id)
        every = store.rounds(info.id)
        rounds = every[:round]
        belief = rounds[-1].belief if rounds else None
        if can_go_on(info) and len(rounds) == len(every):
            belief = conversations.resume(info).belief or belief
        if not (belief and belief.inferred):
            raise HTTPException(404, "There is no belief here.")
        found = reasons(belief, [each.turn for each in rounds], Goal(goal))
        return Why(goal=goal, reasons=found)

    @app.get("/api/episodes/{id}/words")
    async def words(id: str, goal: str, turn: int) -> WordEvidence:
        conversation = await asyncio.to_thread(running, id)
        return WordEvidence(words=await wrap_future(conversation.words(goal, turn)))

    @app.get("/api/episodes/{id}/picture.svg")
    def picture(
        id: str,
        round: Annotated[int, Query(ge=0)],
        width: Annotated[int | None, Query(ge=240, le=1200)] = None,
    ) -> Response:
        info = stored(id)
        return Response(
            room_picture(info, store.rounds(info.id)[:round], width=width),
            media_type="image/svg+xml",
            headers={
                "content-security-policy": "default-src 'none'; style-src 'unsafe-inline'",
                "cache-control": "private, max-age=10",
            },
        )

    @app.get("/api/episodes/{id}/export.json")
    def export(id: str) -> Response:
        info = stored(id)
        text = StoredEpisode.of(info, store.rounds(info.id)).model_dump_json(indent=1)
        headers = {"content-disposition": f'attachment; filename="goalscope-{info.id}.json"'}
        return Response(text, media_type="application/json", headers=headers)

    trackers = Trackers(store, lambda: model, settings)
    (task,) = tasks.values() if len(tasks) == 1 else ("",)
    for operation in Tracking(trackers, task=task).operations:
        app.post(f"/api/tracking/{operation.name}", tags=["tracking"])(_endpoint(operation))
    app.include_router(study_router(store))
    app.add_exception_handler(GoalscopeError, error_response)
    app.add_exception_handler(HTTPException, error_response)
    app.add_exception_handler(RequestValidationError, error_response)
    return app


def _endpoint(operation: Operation) -> Callable[..., BaseModel]:
    def endpoint(body: Any) -> BaseModel:
        return operation.run(**dict(body))

    endpoint.__annotations__ = {"body": operation.body, "return": operation.answer}
    endpoint.__name__, endpoint.__doc__ = operation.name, operation.run.__doc__
    return endpoint


async def _stream(conversation: Conversation) -> AsyncGenerator[str]:
    """Server-sent events; a comment in a long silence reveals a closed connection."""
    with conversation.listening() as queue:
        yield _event("live", conversation.live())
        kind = ""
        while kind != "ended":
            try:
                kind, data = await asyncio.wait_for(queue.get(), KEEPALIVE)
            except TimeoutError:
                yield ": still here\n\n"
            else:
                yield _event(kind, data)


def _event(kind: str, data: BaseModel) -> str:
    return f"event: {kind}\ndata: {data.model_dump_json()}\n\n"


def _domain(name: str, task: str) -> DomainView:
    domain = domain_named(name)
    return DomainView(
        name=name,
        title=domain.label,
        about=domain.about or task,
        view=domain.view,
        scenes=list(domain.scenes()),
    )


def room_picture(info: EpisodeInfo, rounds: Sequence[Round], *, width: int | None = None) -> str:
    """The room from above after these rounds, as an SVG as wide as `width` px.

    What the last round changed stands out.

    Raises:
        InvalidInputError: There is no room in this domain.
    """
    settings = settings_of(info.settings)
    domain = domain_named(info.domain) if info.domain in BUILT_IN else None
    if domain is None or domain.snapshot is None or not domain.replays(settings):
        raise InvalidInputError("This episode has no room to draw.")
    person = None
    if info.profile and not settings.scene:
        person = profile_named(settings, info.profile)
    with open_environment(settings, person) as env:
        replay(env, [result for round in rounds[:-1] for result in round.results])
        before = domain.snapshot(env)
        for round in rounds[-1:]:
            for result in round.results:
                env.step(result.action)
        return domain.draw(env, before, width)
