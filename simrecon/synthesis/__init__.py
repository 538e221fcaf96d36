"""What a person may do next: futures learned from motions (Xie 2021, section 3.4), and their poses."""

from simrecon.synthesis.predicting import Futures, Known, check_moment, predict

__all__ = ["Futures", "Known", "check_moment", "predict"]
