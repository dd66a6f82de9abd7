"""The meaning of a belief: what it starts with, its sources in order, and when it is forgotten."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from socialai_dsl.schema.scenario import Belief, Expression, Source
from socialai_dsl.semantics import texts
from socialai_dsl.semantics.plans import BeliefPlan
from socialai_dsl.semantics.resolver import Declaration, Resolver
from socialai_dsl.semantics.scope import Draws, Scope, is_nothing, reset_scope, surviving
from socialai_dsl.semantics.terms import BOOL, Const, SitedTerm, changed
from socialai_dsl.semantics.texts import Alternative, asked_of_heard, binding, on_hearing, with_slots
from socialai_dsl.source import DataPath


class BeliefResolver:
    """A belief of a member of the cast, and where it is written."""

    def __init__(self, resolver: Resolver, member: str, key: str, belief: Belief) -> None:
        self._resolver, self._member, self._key, self._belief = resolver, member, key, belief
        self._path: DataPath = (*resolver.symbols.cast[member].cases("beliefs")[0].path, key)
        self._site = f"cast.{member}.beliefs.{key}"
        self.register = f"{member}.believes.{key}"

    def declaration(self) -> Declaration:
        """Its register; by default it starts with what is true, as its first source that hears nothing says."""
        path, raw, scope = self._start()
        return Declaration(
            self.register,
            self._key,
            path,
            raw,
            scope,
            starts_with_nothing=is_nothing(raw) and path[-1] == "start",
            gathers=bool(self._belief.from_) or self._belief.start is not None,
            forgets=self._belief.forget is not None,
        )

    def _start(self) -> tuple[DataPath, Expression, Scope]:
        belief = self._belief
        if belief.start is not None:
            path = (*self._path, "start")
            return path, belief.start, reset_scope(path, f"{self._site}.start", self._member)
        if (belief.of is None) == (not belief.from_):
            message = "a belief has `of`, or `from` and a list of sources"
            code = "S105" if belief.of is None else "S107"
            raise self._resolver.findings.fail(
                code, message, self._resolver.findings.places.key_span(self._path)
            )
        if belief.of is not None:
            path = (*self._path, "of")
            return path, belief.of, reset_scope(path, self._site, self._member)
        for i, source in enumerate(belief.from_):
            if not source.hears:
                path = (*self._path, "from", i, "of")
                scope = replace(self._scope(path, f"{self._site}.from[{i}]"), at_reset=True)
                return path, source.of, scope
        span = self._resolver.findings.places.key_span(self._path)
        message = "a belief that is only told of needs a `start`"
        raise self._resolver.findings.fail("S105", message, span, hint="nothing yet is `start: none`")

    def plans(self) -> Iterator[BeliefPlan]:
        """What the register takes at the start of a turn, source by source."""
        forget, lasts = self._forgetting()
        for when, value in self._sources():
            yield BeliefPlan(self._member, self.register, value, when, forget, lasts)

    def _sources(self) -> Iterator[tuple[SitedTerm | None, SitedTerm]]:
        belief = self._belief
        if belief.of is not None:
            scope = replace(reset_scope((), self._site, self._member), at_reset=False)
            yield self._source(Source(of=belief.of, when=belief.when), self._path, self._site, scope)
            return
        for i, source in enumerate(belief.from_):
            with surviving():
                path, site = (*self._path, "from", i), f"{self._site}.from[{i}]"
                yield self._source(source, path, site, self._scope(path, site, bool(source.hears)))

    def _source(
        self, source: Source, path: DataPath, site: str, scope: Scope
    ) -> tuple[SitedTerm | None, SitedTerm]:
        resolver, findings = self._resolver, self._resolver.findings
        of = scope.at((*path, "of"), site)
        value = texts.value_for(resolver, self.register, source.of, of)
        asked = scope.at((*path, "when"), f"{site}.when")
        when = None if source.when is None else resolver.sited(source.when, BOOL, asked)
        heard: Sequence[Alternative] = [
            texts.heard_at(resolver, raw, scope.at(place, f"{site}.hears"))
            for place, raw in findings.each((*path, "hears"), source.hears)
        ]
        if heard:
            span = findings.at((*path, "hears"))
            if wanted := asked_of_heard((value, when)):
                heard = with_slots(resolver, heard, wanted, span)
            when = on_hearing(heard, when, asked.draws.site, span)
            value, when = changed((value, when), binding(heard))
        return when, value

    def _forgetting(self) -> tuple[SitedTerm | None, int]:
        """The condition on which it is forgotten, or after how many turns (0: never)."""
        if self._belief.forget is None:
            return None, 0
        path, findings = (*self._path, "forget"), self._resolver.findings
        scope = self._scope(path, f"{self._site}.forget")
        forget = self._resolver.sited(self._belief.forget, None, scope)
        term = forget.term
        if term.type.kind == "bool":
            return forget, 0
        horizon = self._resolver.symbols.scenario.horizon
        if isinstance(term, Const) and term.type.kind == "int" and 1 <= term.value <= horizon:
            return None, term.value
        message = f"`forget` is a number of turns, 1 to {horizon}, or a condition"
        raise findings.fail("S106", message, findings.at(path))

    def _scope(self, path: DataPath, site: str, hearing: bool = False) -> Scope:
        """What names mean in a source: as in the frame that the member follows."""
        frame = self._resolver.frames.get(self._member)
        return Scope(path, Draws(site), self._member, frame, hearing=hearing)
