"""What one camera saw of a person, turned into a motion that a physics simulator really executed."""

__version__ = "0.1.0"
