"""Writes down what happens, for the timeline. Nothing that moves the robot waits for it."""

from app.gateway.diary.diary import Diary
from app.gateway.diary.session import SessionDiary

__all__ = ["Diary", "SessionDiary"]
