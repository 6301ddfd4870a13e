"""Connections in, those whose request does not come closed out: who keeps them half open would keep everybody else away."""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.h11_impl import H11Protocol

#: Seconds within which a request has to be asked; a browser on the same machine takes a thousandth of one.
PATIENCE = 20.0


class Patient(H11Protocol):
    """A connection that is looked at every `PATIENCE` seconds, and closed if nothing is asked or answered on it then."""

    _next_look: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Begin to look."""
        assert isinstance(transport, asyncio.Transport)
        super().connection_made(transport)
        self._next_look = self.loop.call_later(PATIENCE, self._look)

    def connection_lost(self, exc: Exception | None) -> None:
        """Look no more."""
        if self._next_look is not None:
            self._next_look.cancel()
        super().connection_lost(exc)

    def _look(self) -> None:
        if self.cycle is None or self.cycle.response_complete:
            self.transport.close()
        else:
            self._next_look = self.loop.call_later(PATIENCE, self._look)
