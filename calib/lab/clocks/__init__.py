"""The records of two instruments in, the offset of their clocks out, with its error and how sure it is; knows no sweep."""

from calib.lab.clocks.estimate import clock_offset
from calib.lab.clocks.offset import ClockOffset, Confidence
from calib.lab.clocks.records import beside_tester, loading_window, record
from calib.lab.clocks.way_back import draw_once_turned

__all__ = ["ClockOffset", "Confidence", "beside_tester", "clock_offset", "draw_once_turned", "loading_window", "record"]
