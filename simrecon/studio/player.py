"""Time: play, scrub, speed, and the loop of a range."""

from __future__ import annotations

from dataclasses import dataclass

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0)


@dataclass
class Player:
    """Where the cursor is, and how it moves.

    Attributes:
        first_s, last_s: of the clip.
        time_s: of the cursor.
        playing: whether it moves.
        speed: 1: as it was filmed.
        loop: from and to, s; None: the whole clip.
    """

    first_s: float = 0.0
    last_s: float = 0.0
    time_s: float = 0.0
    playing: bool = False
    speed: float = 1.0
    loop: tuple[float, float] | None = None

    @property
    def span(self) -> tuple[float, float]:
        """What is played."""
        return self.loop or (self.first_s, self.last_s)

    def open(self, first_s: float, last_s: float) -> None:
        """Another clip: the cursor stays where it is, as far as it can."""
        self.first_s, self.last_s, self.loop = first_s, last_s, None
        self.seek(self.time_s)

    def seek(self, time_s: float) -> None:
        """Put the cursor somewhere."""
        self.time_s = min(max(time_s, self.first_s), self.last_s)

    def play(self, playing: bool) -> None:
        """Start or stop; from the end it begins again."""
        low, high = self.span
        if playing and (self.time_s >= high or self.time_s < low):
            self.time_s = low
        self.playing = playing and high > low

    def set_loop(self, low_s: float, high_s: float) -> None:
        """Play a range alone; an empty one: the whole clip."""
        low, high = sorted((max(low_s, self.first_s), min(high_s, self.last_s)))
        self.loop = (low, high) if high - low > 1e-6 else None
        if self.loop is not None and not low <= self.time_s <= high:
            self.time_s = low

    def advance(self, seconds: float) -> None:
        """So much time has passed: at its end the range begins again."""
        if not self.playing:
            return
        low, high = self.span
        ahead = self.time_s + seconds * self.speed
        self.time_s = ahead if ahead < high else low + (ahead - high) % max(high - low, 1e-6)
