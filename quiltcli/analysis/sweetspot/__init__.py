"""How far a person may stand from the eye the content was made for."""

from __future__ import annotations

from quiltcli.analysis.sweetspot.content import Content, content_at
from quiltcli.analysis.sweetspot.study import Question, SweetSpot, ask, sweet_spot

__all__ = ["Content", "Question", "SweetSpot", "ask", "content_at", "sweet_spot"]
